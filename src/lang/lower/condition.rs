//! Conditions and signals of monitors: what both spellings mean.

use super::{Unit, choice, name, number, time};
use crate::lang::grammar::COMPARISON;
use crate::lang::tree::{Cx, Fields, Kind, Node};
use crate::lang::words::{CONDITIONS, SIGNALS, Word};
use crate::limits::MONITOR_DEPTH;
use crate::model::finding::{are, count, did_you_mean};
use crate::model::monitor::{
    Comparison, Condition, ConditionKind, Counter, Interval, MonitoredSignal, PortSignal, SignalKind,
};
use crate::model::{ComponentName, Finding, Ident, MemberRef, Origin, RunState, codes};
use std::time::Duration;

/// Over which time a rate is taken where nothing else is said.
pub const RATE_TIME: Duration = Duration::from_secs(1);

/// A word with its arguments.
struct Term {
    word: &'static Word,
    args: Vec<Node>,
    origin: Origin,
}

impl Term {
    /// Its only, first or second argument; their number has been looked at.
    fn arg(&mut self) -> Node {
        if self.args.is_empty() { Node::new(Kind::Poison, self.origin) } else { self.args.remove(0) }
    }
}

/// What is wanted where a word stands.
#[derive(Clone, Copy)]
struct Expected {
    what: &'static str,
    words: &'static [Word],
    others: &'static [Word],
    example: &'static str,
}

const A_CONDITION: Expected =
    Expected { what: "a condition", words: CONDITIONS, others: SIGNALS, example: "above(\"A.x\", 2.0)" };
const A_SIGNAL: Expected =
    Expected { what: "a signal", words: SIGNALS, others: CONDITIONS, example: "above(\"A.x\", 2.0)" };

/// Reads a word and its arguments: `word(a, b)` of Lua, `{ word: [a, b] }` of YAML.
fn term(cx: &mut Cx, node: Node, wanted: Expected) -> Option<Term> {
    let origin = node.origin;
    let (key, key_origin, args) =
        match node.kind {
            Kind::Made(verb, _, args) => (verb.to_owned(), origin, args),
            Kind::Map(mut entries) if entries.len() == 1 => {
                let entry = entries.pop()?;
                let args = match entry.value.kind {
                    Kind::List(list) => list,
                    _ => vec![entry.value],
                };
                (entry.key.into_owned(), entry.origin, args)
            }
            Kind::Map(entries) if entries.len() > 1 => {
                let finding =
                    Finding::error(codes::MONITOR_ARGUMENTS, format!("{} is one word, here are several", wanted.what));
                cx.report(finding.at(entries[1].origin).labelled("a second one").help(
                    "several conditions stand in a list: `all: [ … ]` or `any: [ … ]`, each with its own braces",
                ));
                return None;
            }
            _ => {
                let example = cx.spelt(origin, wanted.example);
                cx.wrong(&node, "what stands here", &format!("{}, such as `{example}`", wanted.what), &example);
                return None;
            }
        };
    let Some(word) = wanted.words.iter().find(|word| word.name == key) else {
        let shown: String = key.chars().take(60).collect();
        let (message, help) = match wanted.others.iter().find(|word| word.name == key) {
            Some(_) if wanted.what == A_CONDITION.what => (
                format!("`{key}` is a signal, not a condition"),
                cx.either(
                    key_origin,
                    &format!("compare it with something: `above({key}(…), 2.0)`"),
                    &format!("compare it with something: `{{ above: [{{ {key}: [ … ] }}, 2.0] }}`"),
                ),
            ),
            Some(_) => (
                format!("`{key}` is a condition, not a signal"),
                "compared are ports, numbers, and signals made of them".to_owned(),
            ),
            None => (
                format!("there is no {} `{shown}`", wanted.what.trim_start_matches("a ")),
                did_you_mean(&key, "words", wanted.words.iter().map(|word| word.name)),
            ),
        };
        cx.report(Finding::error(codes::MONITOR_UNKNOWN_WORD, message).at(key_origin).help(help));
        return None;
    };
    if args.len() < word.least || args.len() > word.most {
        let most = if word.most > 20 { "or more".to_owned() } else { format!("to {}", word.most) };
        let takes = if word.least == word.most { word.least.to_string() } else { format!("{} {most}", word.least) };
        let takes = count(takes, "argument");
        let message = format!("`{}` takes {takes}, {} given", word.name, are(args.len()));
        let example = cx.spelt(key_origin, word.usage);
        cx.report(
            Finding::error(codes::MONITOR_ARGUMENTS, message).at(key_origin).help(format!("write it like `{example}`")),
        );
        return None;
    }
    Some(Term { word, args, origin: key_origin })
}

fn too_deep(cx: &mut Cx, origin: Origin) {
    let message = format!("conditions and signals within each other, more than {MONITOR_DEPTH} deep");
    cx.report(
        Finding::error(codes::MONITOR_TOO_DEEP, message)
            .at(origin)
            .help("`all` and `any` take as many conditions as are wanted, side by side"),
    );
}

/// A condition.
pub fn condition(cx: &mut Cx, node: Node, depth: usize) -> Option<Condition> {
    use ConditionKind as K;
    if depth >= MONITOR_DEPTH {
        too_deep(cx, node.origin);
        return None;
    }
    let mut t = term(cx, node, A_CONDITION)?;
    let origin = t.origin;
    let inner = |cx: &mut Cx, t: &mut Term| {
        let node = t.arg();
        condition(cx, node, depth + 1).map(Box::new)
    };
    let kind = match t.word.name {
        "is_true" => K::IsTrue(port_signal(cx, &t.arg())?),
        "in_state" => {
            let component = name::<ComponentName>(cx, &t.arg(), "a component", "in_state(\"Arm\", \"running\")");
            let state = run_state(cx, &t.arg());
            K::InState { component: component?, state: state? }
        }
        "faulted" => K::Faulted(name(cx, &t.arg(), "a component", "faulted(\"Arm\")")?),
        "silent" => {
            let port = member(cx, &t.arg());
            let time = within(cx, &t.arg(), "the time of `silent`", t.word.usage);
            K::Silent { port: port?, time: time? }
        }
        "all" => K::All(conditions(cx, t.args, depth)?),
        "any" => K::Any(conditions(cx, t.args, depth)?),
        "no" => K::No(inner(cx, &mut t)?),
        "rise" => K::Rise(inner(cx, &mut t)?),
        "fall" => K::Fall(inner(cx, &mut t)?),
        "implies" => {
            let (first, second) = (inner(cx, &mut t), inner(cx, &mut t));
            K::Implies(first?, second?)
        }
        "once" | "historically" => {
            let condition = inner(cx, &mut t);
            let interval = interval(cx, t.arg(), t.word)?;
            let condition = condition?;
            if t.word.name == "once" {
                K::Once { condition, interval }
            } else {
                K::Historically { condition, interval }
            }
        }
        "since" => {
            let (hold, from) = (inner(cx, &mut t), inner(cx, &mut t));
            let interval = interval(cx, t.arg(), t.word);
            K::Since { hold: hold?, from: from?, interval: interval? }
        }
        "for_at_least" | "within_last" => {
            let condition = inner(cx, &mut t);
            let what = format!("the time of `{}`", t.word.name);
            let time = within(cx, &t.arg(), &what, t.word.usage)?;
            let condition = condition?;
            if t.word.name == "for_at_least" {
                K::ForAtLeast { condition, time }
            } else {
                K::WithinLast { condition, time }
            }
        }
        compared => {
            let (_, op) = Comparison::WORDS.iter().find(|(word, _)| *word == compared)?;
            comparison(cx, t, *op, depth)?
        }
    };
    Some(Condition { kind, origin })
}

fn conditions(cx: &mut Cx, args: Vec<Node>, depth: usize) -> Option<Vec<Condition>> {
    let count = args.len();
    let list: Vec<_> = args.into_iter().filter_map(|node| condition(cx, node, depth + 1)).collect();
    (list.len() == count).then_some(list)
}

fn comparison(cx: &mut Cx, mut t: Term, op: Comparison, depth: usize) -> Option<ConditionKind> {
    let (left, right) = (t.arg(), t.arg());
    let hysteresis = match t.args.pop() {
        None => Some(None),
        Some(node) => hysteresis(cx, node, op).map(Some),
    };
    let (left, right) = (signal(cx, left, depth + 1), signal(cx, right, depth + 1));
    let (left, right, hysteresis) = (left?, right?, hysteresis?);
    let mut age = None;
    left.for_each(&mut |s| age = age.or(matches!(s.kind, SignalKind::Age(_)).then_some(s.origin)));
    right.for_each(&mut |s| age = age.or(matches!(s.kind, SignalKind::Age(_)).then_some(s.origin)));
    let direct = matches!((&left.kind, &right.kind), (SignalKind::Age(_), SignalKind::Constant(_)));
    if let Some(origin) = age
        && (!direct || hysteresis.is_some())
    {
        let message = "an age is compared with a number of seconds, by itself";
        let example = cx.spelt(origin, "above(age(\"A.x\"), 0.1)");
        cx.report(
            Finding::error(codes::MONITOR_AGE, message)
                .at(origin)
                .help(format!("write it like `{example}`; several ages are compared each, in `all` or `any`")),
        );
        return None;
    }
    Some(ConditionKind::Compare { left, op, right, hysteresis })
}

fn hysteresis(cx: &mut Cx, node: Node, op: Comparison) -> Option<f64> {
    let mut fields = Fields::of(cx, node, &COMPARISON)?;
    let node = fields.take(cx, "hysteresis");
    fields.finish(cx);
    let node = node?;
    let v = number(cx, &node, "`hysteresis`", COMPARISON.example)?;
    let wrong = if v < 0.0 {
        Some((
            format!("a hysteresis is 0 or more, this is {v}"),
            "how far back the signal must go before the condition ends",
        ))
    } else if op.is_ordered() {
        None
    } else {
        Some((
            format!("`{}` has no hysteresis", op.word()),
            "only `below`, `at_most`, `above` and `at_least` have a side to which it could reach",
        ))
    };
    if let Some((message, help)) = wrong {
        let origin = cx.place(&node);
        cx.report(Finding::error(codes::MONITOR_BAD_HYSTERESIS, message).at(origin).help(help));
        return None;
    }
    // Not minus zero: it would print as something else than it is equal to.
    Some(v + 0.0)
}

/// A signal.
fn signal(cx: &mut Cx, node: Node, depth: usize) -> Option<MonitoredSignal> {
    use SignalKind as K;
    if depth >= MONITOR_DEPTH {
        too_deep(cx, node.origin);
        return None;
    }
    let origin = cx.place(&node);
    match node.kind {
        Kind::Str(ref text) => {
            if let Some((message, example, why)) = no_port(text) {
                let help = format!("write it like `{}`{why}", cx.spelt(node.origin, &example));
                cx.report(Finding::error(codes::TEXT_WRONG_TYPE, message).at(origin).help(help));
                return None;
            }
            return Some(MonitoredSignal { kind: K::Port(port_signal(cx, &node)?), origin });
        }
        Kind::Int(_) | Kind::Float(_) => {
            let v = number(cx, &node, "a constant", "2.0")?;
            return Some(MonitoredSignal { kind: K::Constant(v), origin });
        }
        _ => {}
    }
    let mut t = term(cx, node, A_SIGNAL)?;
    let origin = t.origin;
    let list = |cx: &mut Cx, args: Vec<Node>| {
        let count = args.len();
        let list: Vec<_> = args.into_iter().filter_map(|node| signal(cx, node, depth + 1)).collect();
        (list.len() == count).then_some(list)
    };
    let kind = match t.word.name {
        "age" => K::Age(member(cx, &t.arg())?),
        "sample_rate" => {
            let port = member(cx, &t.arg());
            let over = match t.args.pop() {
                None => Some(RATE_TIME),
                Some(node) => within(cx, &node, "the time of `sample_rate`", t.word.usage),
            };
            K::Rate { port: port?, over: over? }
        }
        "activity" => {
            let activity = name::<Ident>(cx, &t.arg(), "an activity", t.word.usage);
            let counter = choice(cx, &t.arg(), "the counter of an activity", Counter::WORDS);
            K::Activity { activity: activity?, counter: counter? }
        }
        "norm" => K::Norm(list(cx, t.args)?),
        "min" => K::Min(list(cx, t.args)?),
        "max" => K::Max(list(cx, t.args)?),
        "difference" => {
            let (a, b) = (t.arg(), t.arg());
            let (a, b) = (signal(cx, a, depth + 1), signal(cx, b, depth + 1));
            K::Difference(Box::new(a?), Box::new(b?))
        }
        _ => {
            let of = t.arg();
            K::Abs(Box::new(signal(cx, of, depth + 1)?))
        }
    };
    Some(MonitoredSignal { kind, origin })
}

/// What a text is that cannot be a port: a number with its unit, or a word with what it is said of. With how that is written.
fn no_port(text: &str) -> Option<(String, String, &'static str)> {
    let text = text.trim();
    let end = text.find(|c: char| !c.is_ascii_digit() && !matches!(c, '.' | '-' | '+')).unwrap_or(text.len());
    if let Ok(number) = text[..end].parse::<f64>() {
        let message = format!("`{text}` is a text, where a number is wanted");
        return Some((message, format!("above(\"A.x\", {number})"), ": the number alone, in the unit of the port"));
    }
    let (word, of) = text.strip_suffix(')')?.split_once('(')?;
    let word = SIGNALS.iter().find(|known| known.name == word.trim())?;
    let quoted = |of: &str| match of.trim().trim_matches(['"', '\'']) {
        number if number.parse::<f64>().is_ok() => number.to_owned(),
        name => format!("\"{name}\""),
    };
    let of: Vec<String> = of.split(',').map(quoted).collect();
    let message = "this is no name of a port, but a signal made of one".to_owned();
    Some((message, format!("{}({})", word.name, of.join(", ")), ""))
}

fn port_signal(cx: &mut Cx, node: &Node) -> Option<PortSignal> {
    name(cx, node, "a port", "Dynamics.force[0]")
}

fn member(cx: &mut Cx, node: &Node) -> Option<MemberRef> {
    name(cx, node, "a port", "Dynamics.force")
}

fn run_state(cx: &mut Cx, node: &Node) -> Option<RunState> {
    let Kind::Str(text) = &node.kind else {
        cx.wrong(node, "a run state", "a text", "in_state(\"Arm\", \"running\")");
        return None;
    };
    let state = RunState::from_name(text);
    if state.is_none() {
        let origin = cx.place(node);
        // Our own names before the field's, which differ from them in a capital letter.
        let ours = ["unconfigured", "stopped", "running", "faulted"];
        let help = did_you_mean(text, "states", ours);
        cx.report(Finding::error(codes::CONF_BAD_STATE, format!("`{text}` is not a run state")).at(origin).help(help));
    }
    state
}

/// A time that something must last.
fn within(cx: &mut Cx, node: &Node, what: &str, example: &str) -> Option<Duration> {
    time(cx, node, what, Unit::Seconds, example)
}

/// A closed interval of time before now: `{ a, b }` in seconds, `b` may be infinite.
fn interval(cx: &mut Cx, node: Node, word: &'static Word) -> Option<Interval> {
    let origin = node.origin;
    let what = format!("the interval of `{}`", word.name);
    let Node { kind: Kind::List(list), .. } = node else {
        cx.wrong(&node, &what, "two numbers of seconds", word.usage);
        return None;
    };
    let Ok([from, to]) = <[Node; 2]>::try_from(list) else {
        let example = cx.spelt(origin, word.usage);
        cx.report(
            Finding::error(codes::MONITOR_BAD_INTERVAL, format!("{what} has two ends"))
                .at(origin)
                .help(format!("write it like `{example}`: from so many seconds ago to so many")),
        );
        return None;
    };
    let from = end(cx, &from, &what, word)?;
    let to = end(cx, &to, &what, word)?;
    let Some(from) = from else {
        cx.report(
            Finding::error(codes::MONITOR_BAD_INTERVAL, format!("{what} begins at a time that never was"))
                .at(origin)
                .help("the newer end comes first, and only the older one may be infinite"),
        );
        return None;
    };
    if to.is_some_and(|to| to < from) {
        cx.report(
            Finding::error(codes::MONITOR_BAD_INTERVAL, format!("{what} ends before it begins"))
                .at(origin)
                .help("the newer end comes first: `{ 0, 1.5 }` is from now to a second and a half ago"),
        );
        return None;
    }
    Some(Interval { from, to })
}

/// An end of an interval; none: infinitely long ago.
fn end(cx: &mut Cx, node: &Node, what: &str, word: &'static Word) -> Option<Option<Duration>> {
    let v = match node.kind {
        #[allow(clippy::cast_precision_loss)]
        Kind::Int(v) => v as f64,
        Kind::Float(v) => v,
        _ => f64::NAN,
    };
    if v == f64::INFINITY {
        return Some(None);
    }
    if v == 0.0 {
        return Some(Some(Duration::ZERO));
    }
    if v < 0.0 {
        let origin = cx.place(node);
        cx.report(
            Finding::error(codes::MONITOR_BAD_INTERVAL, format!("{what} lies in the past, {v} s is in the future"))
                .at(origin)
                .help(format!("both ends say how long ago: write it like `{}`", word.usage)),
        );
        return None;
    }
    time(cx, node, &format!("an end of {what}"), Unit::Seconds, word.usage).map(Some)
}
