//! Findings: what is wrong, as data.
//!
//! A finding carries a stable [`Code`], the element it is about (an [`Origin`], which the source map turns into a place
//! in a text, and a path in the model for when there is no text), further labels, and what to do next. Turning findings
//! into words on a terminal is the business of `diagnostics` alone.

pub use super::codes::Code;
use crate::limits;

/// Where in the user's text a model element came from: an index into the source map that the loader made.
///
/// Origins are no part of the meaning: two elements that differ only in origin are equal.
#[derive(Debug, Clone, Copy, Default)]
pub struct Origin(pub u32);

impl Origin {
    /// The origin of what was never written in a file (built from Rust, or made up by a default).
    pub const NONE: Self = Self(0);

    /// Whether there is a text to point at.
    pub fn is_some(self) -> bool {
        self.0 != 0
    }
}

impl PartialEq for Origin {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
impl Eq for Origin {}
impl std::hash::Hash for Origin {
    fn hash<H: std::hash::Hasher>(&self, _: &mut H) {}
}

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Good to know.
    Info,
    /// Allowed, and likely not what was meant.
    Warning,
    /// Refused.
    Error,
}

/// A second place that explains the first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// The element.
    pub origin: Origin,
    /// What it has to do with the finding.
    pub text: String,
}

/// One thing that is wrong, or worth saying.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// The stable code.
    pub code: Code,
    /// How much it matters.
    pub severity: Severity,
    /// One sentence, without a final stop.
    pub message: String,
    /// The element at fault.
    pub origin: Origin,
    /// What to write at the place itself; empty: nothing.
    pub label: String,
    /// The element's path in the model, `configurations.engage.changes[2]`; empty when unknown.
    pub path: String,
    /// Other places that explain it.
    pub labels: Vec<Label>,
    /// What to do next.
    pub help: Option<String>,
}

impl Finding {
    /// A finding of the given severity at no place yet.
    pub fn new(severity: Severity, code: Code, message: impl Into<String>) -> Self {
        Self {
            code,
            severity,
            message: message.into(),
            origin: Origin::NONE,
            label: String::new(),
            path: String::new(),
            labels: Vec::new(),
            help: None,
        }
    }

    /// An error.
    pub fn error(code: Code, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, message)
    }

    /// A warning.
    pub fn warning(code: Code, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, message)
    }

    /// Information.
    pub fn info(code: Code, message: impl Into<String>) -> Self {
        Self::new(Severity::Info, code, message)
    }

    /// The same, at a place.
    #[must_use]
    pub fn at(mut self, origin: Origin) -> Self {
        self.origin = origin;
        self
    }

    /// The same, with a text at the place.
    #[must_use]
    pub fn labelled(mut self, text: impl Into<String>) -> Self {
        self.label = text.into();
        self
    }

    /// The same, with the element's path in the model.
    #[must_use]
    pub fn path(mut self, path: impl Into<String>) -> Self {
        self.path = path.into();
        self
    }

    /// The same, with a second place.
    #[must_use]
    pub fn also(mut self, origin: Origin, text: impl Into<String>) -> Self {
        self.labels.push(Label { origin, text: text.into() });
        self
    }

    /// The same, with what to do next.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    /// What was found, and what to do, in one line.
    pub fn in_a_line(&self) -> String {
        match &self.help {
            Some(help) => format!("{}: {help}", self.message),
            None => self.message.clone(),
        }
    }

    /// Whether it refuses.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// A list of findings, in the order they were made.
pub type Findings = Vec<Finding>;

/// Whether any of `findings` refuses.
pub fn has_errors(findings: &[Finding]) -> bool {
    findings.iter().any(Finding::is_error)
}

/// The name of the configuration that a finding is about, if it is about one and nothing else.
pub fn configuration(finding: &Finding) -> Option<&str> {
    let rest = finding.path.strip_prefix("configurations.")?;
    Some(rest.split('.').next().unwrap_or(rest))
}

/// The known name nearest to `name`, if one is near enough to be what was meant: as a whole, or, where `name` has one part
/// only, by its last part (`Gian` for `standard.Gain`), or as one of its words (`set` for `property_set`).
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // To compare takes time by the lengths of both, and nobody has meant one by that.
    if name.len() > limits::NEAR_NAME {
        return None;
    }
    // Whether it is near enough is asked of the whole; which is nearest, of what would have to be typed otherwise, and then of how they
    // begin: capitals count only there.
    let near = |candidate: &str| {
        let (ours, other) = (name.to_lowercase(), candidate.to_lowercase());
        let begins = name.chars().next().map(char::is_uppercase) == candidate.chars().next().map(char::is_uppercase);
        let slips = strsim::osa_distance(&ours, &other) + usize::from(!begins);
        // That both are events (`e_`) makes `e_far` no slip of `e_start`.
        let alike = match (ours.strip_prefix("e_"), other.strip_prefix("e_")) {
            (Some(ours), Some(other)) => strsim::jaro_winkler(ours, other),
            _ => strsim::jaro_winkler(&ours, &other),
        };
        (slips, alike, strsim::jaro_winkler(name, candidate))
    };
    known
        .into_iter()
        .filter(|candidate| *candidate != name)
        .flat_map(|candidate| {
            let last = candidate.rsplit_once('.').filter(|_| !name.contains('.')).map(|(_, last)| last);
            let word = candidate.split('_').find(|word| word.len() > 2 && *word == name);
            std::iter::once(candidate).chain(last).chain(word).map(move |part| (near(part), candidate))
        })
        .filter(|((_, score, _), candidate)| *score > 0.8 || is_short_for(name, candidate))
        .min_by(|(a, one), (b, other)| a.0.cmp(&b.0).then(b.2.total_cmp(&a.2)).then(one.cmp(other)))
        .map(|(_, candidate)| candidate)
}

/// Whether a letter of a short word is missing (`mx`), two of it stand the other way round (`scr`), or one without vowels is written out
/// (`target`, of `tgt`).
fn is_short_for(name: &str, candidate: &str) -> bool {
    let sorted = |word: &str| {
        let mut letters: Vec<char> = word.chars().collect();
        letters.sort_unstable();
        letters
    };
    let swapped = || sorted(name) == sorted(candidate) && strsim::osa_distance(name, candidate) == 1;
    let shorter = || {
        let begins = name.chars().next() == candidate.chars().next();
        begins && name.len() == 2 && candidate.len() == 3 && strsim::osa_distance(name, candidate) == 1
    };
    let written_out = || {
        let mut letters = name.chars().peekable();
        letters.peek().copied() == candidate.chars().next()
            && !candidate.contains(['a', 'e', 'i', 'o', 'u'])
            && candidate.chars().all(|wanted| letters.any(|letter| letter == wanted))
    };
    candidate.len() > 2 && (shorter() || swapped() || written_out())
}

/// Which of two words was meant, where it must be one of them: the one with fewer slips of the finger, else the first.
pub fn closest<'a>(name: &str, [one, other]: [&'a str; 2]) -> &'a str {
    let slips = |word: &str| strsim::osa_distance(&name.to_lowercase(), word);
    if slips(other) < slips(one) { other } else { one }
}

/// `3 steps`, `1 step`, `2 properties`.
pub fn count(number: impl std::fmt::Display, what: &str) -> String {
    let number = number.to_string();
    match what.strip_suffix('y') {
        _ if number == "1" => format!("{number} {what}"),
        Some(stem) if !stem.ends_with(['a', 'e', 'o', 'u']) => format!("{number} {stem}ies"),
        _ => format!("{number} {what}s"),
    }
}

/// `1 is`, `3 are`.
pub fn are(number: usize) -> String {
    format!("{number} {}", if number == 1 { "is" } else { "are" })
}

/// The usual help for an unknown name: the nearest known one, else the list of known ones (at most eight of them).
pub fn did_you_mean<'a>(name: &str, what: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    if let Some(near) = nearest(name, known.iter().copied()) {
        return format!("did you mean `{near}`?");
    }
    if known.is_empty() {
        return format!("there are no {what} here");
    }
    let shown: Vec<String> = known.iter().take(8).map(|k| format!("`{k}`")).collect();
    let more = if known.len() > 8 { format!(" and {} more", known.len() - 8) } else { String::new() };
    format!("known {what}: {}{more}", shown.join(", "))
}

/// The same of something that may be in a subsystem: a name without the path means those of that name inside, and the path of a subsystem what
/// is in it.
pub fn did_you_mean_path<'a>(name: &str, what: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let within = |path: &str| path.strip_prefix(name).is_some_and(|rest| rest.starts_with('/'));
    let inside: Vec<&str> = known.iter().copied().filter(|path| within(path)).collect();
    if !inside.is_empty() {
        return format!("`{name}` is a subsystem; {}", did_you_mean("", what, inside));
    }
    let meant = meant(name, known.iter().copied());
    match meant.is_empty() {
        true => did_you_mean(name, what, known),
        false => format!("did you mean `{}`?", meant.join("` or `")),
    }
}

/// Which of some known names may be meant by one that is none of them, also by what they are called in their subsystems.
pub fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Vec<&'a str> {
    let last = |path: &'a str| path.rsplit_once('/').map_or(path, |(_, last)| last);
    let of = |word: &str| -> Vec<&str> { known.clone().filter(|path| last(path) == word).take(3).collect() };
    match of(name) {
        none if none.is_empty() => match nearest(name, known.clone()) {
            Some(near) => vec![near],
            None => nearest(name, known.clone().map(last)).map(of).unwrap_or_default(),
        },
        inside => inside,
    }
}

/// A help with more behind it, which begins a sentence of its own behind a question.
pub fn and_also(help: &str, more: &str) -> String {
    let mut letters = more.chars();
    match (help.ends_with('?'), letters.next()) {
        (true, Some(first)) => format!("{help} {}{}", first.to_uppercase(), letters.as_str()),
        _ => format!("{help}; {more}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_one_thing_there_is_no_plural() {
        assert_eq!(
            [count(1, "step"), count(0, "step"), count(2_u64, "property")],
            ["1 step", "0 steps", "2 properties"]
        );
        assert_eq!(
            [count(1, "entry"), count("1,000", "entry"), count(2, "key")],
            ["1 entry", "1,000 entries", "2 keys"]
        );
    }

    #[test]
    fn near_names_are_found_as_a_whole_and_by_their_last_part() {
        let known = ["standard.Gain", "standard.Constant", "youbot.Dynamics"];
        assert_eq!(nearest("Gian", known), Some("standard.Gain"));
        assert_eq!(nearest("Gain", known), Some("standard.Gain"));
        assert_eq!(nearest("yubot.Dynamics", known), Some("youbot.Dynamics"));
        assert_eq!(nearest("Winch", known), None);
        let events = ["e_start", "e_stop"];
        assert_eq!([nearest("e_far", events), nearest("e_strat", events)], [None, Some("e_start")]);
        let words = ["Configuration", "ConfiguratorConf", "Monitors", "monitor"];
        assert_eq!(
            nearest("ConfigurationConf", words),
            Some("ConfiguratorConf"),
            "the fewest slips, not the same beginning"
        );
        assert_eq!(nearest("Monitor", words), Some("Monitors"), "a capital that was meant");
        assert_eq!(nearest("MONITOR", words), Some("Monitors"));
        assert_eq!(nearest("e_strat", ["e_stop", "e_start"]), Some("e_start"));
        assert_eq!(nearest("run.udno", ["run", "run.undo"]), Some("run.undo"));
        assert_eq!(nearest("other.Winch", known), None);
        assert_eq!(nearest("arm", ["arm"]), None, "itself is no help");
        let keys = ["src", "tgt", "events", "pn"];
        let meant = ["scr", "target", "source", "tagret", "pen", "guard"].map(|name| nearest(name, keys));
        assert_eq!(meant, [Some("src"), Some("tgt"), Some("src"), Some("tgt"), None, None]);
    }
}
