//! Component libraries, written against the runtime as any user's library would be.

pub mod youbot;
