//! What came of trying the rules, for programs and for people.

use super::Rule;
use std::fmt;

/// What a platform did otherwise than a rule demands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BrokenRule {
    /// With what it was tried.
    pub with: String,
    /// What was expected.
    pub expected: String,
    /// What was seen instead.
    pub seen: String,
}

/// What came of trying one rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RuleVerdict {
    /// The platform keeps it.
    Kept,
    /// It does not.
    Broken(BrokenRule),
    /// It was not tried, and why.
    Skipped(String),
}

/// What came of trying all rules.
pub struct RuleReport {
    verdicts: Vec<(&'static Rule, RuleVerdict)>,
}

impl RuleReport {
    pub(super) fn new(verdicts: Vec<(&'static Rule, RuleVerdict)>) -> Self {
        Self { verdicts }
    }

    /// Every rule with its verdict.
    pub fn verdicts(&self) -> &[(&'static Rule, RuleVerdict)] {
        &self.verdicts
    }

    /// Those that are not kept, with what was seen.
    pub fn broken(&self) -> impl Iterator<Item = (&'static Rule, &BrokenRule)> {
        self.verdicts.iter().filter_map(|(rule, verdict)| match verdict {
            RuleVerdict::Broken(broken) => Some((*rule, broken)),
            _ => None,
        })
    }

    /// Those that were not tried, and why.
    pub fn skipped(&self) -> impl Iterator<Item = (&'static Rule, &str)> {
        self.verdicts.iter().filter_map(|(rule, verdict)| match verdict {
            RuleVerdict::Skipped(why) => Some((*rule, why.as_str())),
            _ => None,
        })
    }

    /// Whether every rule that was tried is kept.
    pub fn is_kept(&self) -> bool {
        self.broken().next().is_none()
    }
}

impl fmt::Display for RuleReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (broken, skipped) = (self.broken().count(), self.skipped().count());
        let kept = self.verdicts.len() - broken - skipped;
        writeln!(f, "{} rules: {kept} kept, {broken} broken, {skipped} not tried", self.verdicts.len())?;
        for (rule, BrokenRule { with, expected, seen }) in self.broken() {
            writeln!(f, "\nbroken: {}", rule.name)?;
            writeln!(f, "  demands   {}", rule.demands)?;
            writeln!(f, "  with      {with}")?;
            writeln!(f, "  expected  {expected}")?;
            writeln!(f, "  seen      {seen}")?;
        }
        if skipped > 0 {
            writeln!(f)?;
        }
        self.skipped().try_for_each(|(rule, why)| writeln!(f, "not tried: {} ({why})", rule.name))
    }
}
