//! What a platform does with what is written, as far as that decides what can be written for it.

use super::names::Ident;

/// The kind of a platform. What its components do is its own affair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlatformKind {
    /// Components are code of this program's libraries: one of a type that is only declared cannot be made.
    pub runs_libraries: bool,
    /// Components are imitated: what the deployment says under `simulated` and `faults` happens.
    pub imitates: bool,
    /// What ports carry can be seen. Where it cannot, what configurations stand for is judged by run states alone.
    pub shows_values: bool,
}

impl PlatformKind {
    /// Components are Rust types in this process.
    pub const EMBEDDED: Self = Self { runs_libraries: true, imitates: false, shows_values: true };
    /// There are only books of components.
    pub const SIMULATED: Self = Self { runs_libraries: false, imitates: true, shows_values: false };
    /// Components live elsewhere: on other hosts, in other programs.
    pub const ELSEWHERE: Self = Self { runs_libraries: false, imitates: false, shows_values: true };

    /// The platforms that every program has.
    pub const BUILT_IN: [(&'static str, Self); 2] = [("embedded", Self::EMBEDDED), ("simulated", Self::SIMULATED)];

    /// That of a platform as far as its name tells: of one that is not built in nothing is known yet.
    pub fn of(name: Ident) -> Self {
        let built_in = Self::BUILT_IN.iter().find(|(built_in, _)| *built_in == name.as_str());
        built_in.map_or(Self::ELSEWHERE, |(_, kind)| *kind)
    }
}
