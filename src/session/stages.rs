//! Which stage of stopping comes next (semantics: *Stopping*). Pure: what happened in, what to do out.

use serde::{Deserialize, Serialize};

/// The stages in which a deployment is stopped, whatever asked for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The shutdown event was raised, and the coordinator leads down.
    Led,
    /// The coordinator is left out; what is under way is given up, and frames are popped.
    TakenBack,
    /// What is safe and what brings it to rest are applied, then everything is removed.
    Forced,
}

impl Stage {
    /// How the deployment is stopped in it, for a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::Led => "by its coordinator",
            Self::TakenBack => "without its coordinator",
            Self::Forced => "by force",
        }
    }
}

/// How a stage ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Came {
    /// Nothing is left.
    Empty,
    /// Something is left: why it went no further.
    Left(String),
    /// Force was asked for meanwhile: a second signal, or `--force`.
    Hurried,
}

/// What follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NextStage {
    /// It is over.
    Over,
    /// The next stage begins.
    Stage(Stage),
    /// Somebody has to ask for force: a safe configuration holds what is left.
    Held,
}

/// The first stage. `leads`: there is a coordinator that can lead down.
pub fn first(force: bool, leads: bool) -> Stage {
    match (force, leads) {
        (true, _) => Stage::Forced,
        (false, true) => Stage::Led,
        (false, false) => Stage::TakenBack,
    }
}

/// What follows a stage that ended so. `held`: a safe configuration is in force that nobody has let go.
pub fn next(stage: Stage, came: &Came, held: bool) -> NextStage {
    match (stage, came) {
        (_, Came::Empty) => NextStage::Over,
        // An emergency while it was forced.
        (Stage::Forced, Came::Left(_)) if held => NextStage::Held,
        (Stage::Forced, _) => NextStage::Over,
        (_, Came::Hurried) => NextStage::Stage(Stage::Forced),
        (Stage::Led, Came::Left(_)) => NextStage::Stage(Stage::TakenBack),
        (Stage::TakenBack, Came::Left(_)) if held => NextStage::Held,
        (Stage::TakenBack, Came::Left(_)) => NextStage::Stage(Stage::Forced),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_stage_after_the_other_and_force_whenever_it_is_asked_for() {
        let left = || Came::Left("late".to_owned());
        for held in [false, true] {
            for stage in [Stage::Led, Stage::TakenBack, Stage::Forced] {
                assert_eq!(next(stage, &Came::Empty, held), NextStage::Over);
            }
            assert_eq!(next(Stage::Led, &left(), held), NextStage::Stage(Stage::TakenBack));
            assert_eq!(next(Stage::Led, &Came::Hurried, held), NextStage::Stage(Stage::Forced));
            assert_eq!(next(Stage::TakenBack, &Came::Hurried, held), NextStage::Stage(Stage::Forced));
        }
        assert_eq!(next(Stage::Forced, &left(), false), NextStage::Over, "nothing comes after force");
        assert_eq!(next(Stage::Forced, &left(), true), NextStage::Held, "an emergency meanwhile");
        assert_eq!(next(Stage::TakenBack, &left(), false), NextStage::Stage(Stage::Forced));
        assert_eq!(
            next(Stage::TakenBack, &left(), true),
            NextStage::Held,
            "what is held still is let go by nobody but people"
        );
        assert_eq!(
            [first(false, true), first(false, false), first(true, true)],
            [Stage::Led, Stage::TakenBack, Stage::Forced]
        );
    }
}
