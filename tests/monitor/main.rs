//! Monitors: the evaluator, against a reference that evaluates the definitions over the whole history.

mod check;
mod events;
mod naive;
mod random;
mod support;
