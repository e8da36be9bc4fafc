//! Coordinators with functions: what they may do, what they are given, and what becomes of those that misbehave.

mod confirmed;
mod deployed;
mod faults;
mod lab;
mod loading;
mod rfsm;
mod support;
