//! Coordinators with functions: what they may do, what they are given, and what becomes of those that misbehave.

mod deployed;
mod loading;
mod support;
