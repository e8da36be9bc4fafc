//! Coordinators with functions: what they may do, what they are given, and what becomes of those that misbehave.

mod confirmed;
mod convert;
mod dbg;
mod deployed;
mod faults;
mod guide;
mod lab;
mod late;
mod library;
mod loading;
mod merge;
mod named;
mod purity;
mod rfsm;
mod slips;
mod support;
