//! Charts with functions made up from random bytes: the engine with Lua functions, and the naive interpreter with the same
//! functions as small programs, side by side. The functions note what they see, send events, say yes, no and nothing, raise
//! errors and yield.

use crate::naive::{Answer, Naive, Program, Rich};
use crate::random::{EVENTS, chart};
use davit::functions::Opener;
use davit::lang::{LoadOptions, Sources, load_coordinator};
use davit::model::statechart::{Action, ChartNode, State, Statechart, Trigger};
use davit::statechart::{Sim, compile};
use proptest::prelude::*;
use std::cell::Cell;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

/// More than this a line is cut off by the engine (`limits::SAID_LINES`).
const SAID: usize = 250;

/// Choices out of bytes, round and round: what a chart's own bytes decide is decided before.
struct Choices<'a>(&'a [u8], usize);

impl Choices<'_> {
    fn below(&mut self, n: usize) -> usize {
        self.1 += 1;
        self.0.get((self.1 - 1) % self.0.len().max(1)).map_or(0, |byte| usize::from(*byte) % n)
    }
}

struct Maker<'a> {
    choices: Choices<'a>,
    rich: Rich,
    programs: usize,
    transitions: usize,
}

impl Maker<'_> {
    fn program(&mut self, answers: &[Answer], most: usize) -> Program {
        let id = self.programs;
        self.programs += 1;
        let sends = match self.choices.below(6) {
            0 => vec![EVENTS[self.choices.below(4)].to_owned()],
            1 => vec!["own".to_owned(), EVENTS[self.choices.below(4)].to_owned()],
            _ => Vec::new(),
        };
        let count = 1 + self.choices.below(most);
        let answers = (0..count).map(|_| answers[self.choices.below(answers.len())]).collect();
        Program { id, sends, answers }
    }

    fn state(&mut self, state: &State, fqn: &str) {
        use Answer::{Error, No, Nothing, Yes};
        const DONE: [Answer; 4] = [Nothing, Nothing, Yes, Error];
        if self.choices.below(3) == 0 {
            let program = self.program(&DONE, 2);
            self.rich.entry.insert(fqn.to_owned(), program);
        }
        if self.choices.below(3) == 0 {
            let program = self.program(&DONE, 2);
            self.rich.exit.insert(fqn.to_owned(), program);
        }
        if state.children.is_empty() && self.choices.below(3) == 0 {
            let parts = self.choices.below(4);
            let parts = (0..parts).map(|_| self.program(&[Yes, No, Nothing, Yes, Error], 1)).collect();
            self.rich.doo.insert(fqn.to_owned(), parts);
        }
        for _ in &state.transitions {
            let number = self.transitions;
            self.transitions += 1;
            if self.choices.below(3) == 0 {
                let program = self.program(&[Yes, Nothing, No, Yes, Nothing, Error], 3);
                self.rich.guard.insert(number, program);
            }
            if self.choices.below(3) == 0 {
                let program = self.program(&DONE, 2);
                self.rich.effect.insert(number, program);
            }
            if self.choices.below(5) == 0 {
                let count = 1 + self.choices.below(2);
                let programs = (0..count).map(|_| self.program(&[No, Yes, Nothing, No, Error], 3));
                // A predicate is given the event and no machine to send to.
                let programs = programs.map(|program| Program { sends: Vec::new(), ..program }).collect();
                self.rich.predicates.insert(number, programs);
            }
        }
        for child in &state.children {
            if let ChartNode::State(inner) = child {
                self.state(inner, &format!("{fqn}.{}", inner.name));
            }
        }
    }
}

fn answer(answer: Answer) -> &'static str {
    match answer {
        Answer::Yes => "true",
        Answer::No => "false",
        Answer::Nothing => "nil",
        Answer::Error => "ERROR",
    }
}

/// A call of `maker` in the preamble that makes the function.
fn made(maker: &str, program: &Program) -> String {
    let sends: Vec<String> = program.sends.iter().map(|event| format!("'{event}'")).collect();
    let answers: Vec<&str> = program.answers.iter().map(|a| answer(*a)).collect();
    let (id, count) = (program.id, answers.len());
    format!("{maker}({id}, {{ {} }}, {{ n = {count}, {} }})", sends.join(", "), answers.join(", "))
}

const PREAMBLE: &str = "
local ERROR = {}
local function sight(fsm)
  local conf = rfsm.get_active_conf(fsm)
  return tostring(conf[#conf]) .. ' ' .. tostring(rfsm.get_actleaf_fqn(fsm))
end
local function texts(events)
  local out = {}
  for i, event in ipairs(events) do out[i] = tostring(event) end
  return table.concat(out, ',')
end
local function go(id, sends, answers, fsm, detail, calls)
  print(id .. ' ' .. detail)
  for _, event in ipairs(sends) do rfsm.send_events(fsm, event) end
  local answer = answers[calls % answers.n + 1]
  if answer == ERROR then error('no', 0) end
  return answer
end
local function counted(f)
  local calls = -1
  return function(...) calls = calls + 1 return f(calls, ...) end
end
local function root(state)
  while state._parent ~= state do state = state._parent end
  return state
end
local function ofstate(id, sends, answers)
  return counted(function(calls, fsm, state)
    return go(id, sends, answers, fsm, state._fqn .. ' ' .. sight(fsm), calls)
  end)
end
local function ends(tr) return tr.src._fqn .. '>' .. tr.tgt._fqn end
local function effect(id, sends, answers)
  return counted(function(calls, fsm, tr, what, events)
    return go(id, sends, answers, fsm, ends(tr) .. ' ' .. sight(fsm) .. ' ' .. texts(events), calls)
  end)
end
local function guard(id, sends, answers)
  return counted(function(calls, tr, events)
    local mode = rfsm.is_conn(tr.src) and '-' or rfsm.get_sta_mode(tr.src)
    return go(id, sends, answers, root(tr.src), ends(tr) .. ' ' .. mode .. ' ' .. texts(events), calls)
  end)
end
local function predicate(id, sends, answers)
  return counted(function(calls, event) return go(id, sends, answers, nil, tostring(event), calls) end)
end
local function doo(...)
  local parts = { ... }
  return function(fsm, state)
    for _, part in ipairs(parts) do rfsm.yield(part(fsm, state)) end
  end
end
";

/// The model in Lua.
fn lua(model: &Statechart, rich: &Rich) -> String {
    fn names(actions: &[(Action, davit::model::Origin)]) -> impl Iterator<Item = String> + '_ {
        actions.iter().map(|(action, _)| match action {
            Action::Raise(name) => format!("'{name}'"),
            Action::Function(_) => unreachable!("the chart is pure"),
        })
    }
    fn state(out: &mut String, state_: &State, fqn: &str, rich: &Rich, transitions: &mut usize) {
        out.push_str("rfsm.state {\n");
        if fqn == "root" {
            out.push_str("err = function(tag, _, why) print('ERR ' .. tostring(tag) .. ' ' .. tostring(why)) end,\n");
            out.push_str("warn = function(a, b) print('WARN ' .. a .. (b or '')) end, info = false,\n");
        }
        let list = |first: Option<String>, rest: &mut dyn Iterator<Item = String>| {
            first.into_iter().chain(rest).collect::<Vec<_>>().join(", ")
        };
        let entry = rich.entry.get(fqn).map(|p| made("ofstate", p));
        let exit = rich.exit.get(fqn).map(|p| made("ofstate", p));
        let _ = writeln!(out, "entry = {{ {} }},", list(entry, &mut names(&state_.entry)));
        let _ = writeln!(out, "exit = {{ {} }},", list(exit, &mut names(&state_.exit)));
        let _ =
            writeln!(out, "config = {{ {} }},", list(None, &mut state_.config.iter().map(|(id, _)| format!("'{id}'"))));
        if let Some(parts) = rich.doo.get(fqn) {
            let parts: Vec<String> = parts.iter().map(|p| made("ofstate", p)).collect();
            let _ = writeln!(out, "doo = doo({}),", parts.join(", "));
        }
        for transition in &state_.transitions {
            let number = *transitions;
            *transitions += 1;
            let (src, tgt) = (&transition.src.as_ref().unwrap().0, &transition.tgt.as_ref().unwrap().0);
            let mut events = transition.events.iter().map(|(trigger, _)| match trigger {
                Trigger::Event(name) => format!("'{name}'"),
                Trigger::Timed(timed) => format!("'{}'", timed),
                Trigger::Predicate(_) => unreachable!("the chart is pure"),
            });
            let predicates = rich.predicates.get(&number).into_iter().flatten();
            let events = list(None, &mut predicates.map(|p| made("predicate", p)).chain(&mut events));
            let effect = list(rich.effect.get(&number).map(|p| made("effect", p)), &mut names(&transition.effect));
            let guard = rich.guard.get(&number).map(|p| format!(", guard = {}", made("guard", p))).unwrap_or_default();
            let pn = transition.pn;
            let _ = writeln!(
                out,
                "rfsm.trans {{ src = '{src}', tgt = '{tgt}', pn = {pn}, events = {{ {events} }}, effect = {{ {effect} }}{guard} }},"
            );
        }
        for child in &state_.children {
            let _ = write!(out, "{} = ", child.name());
            match child {
                ChartNode::State(inner) => state(out, inner, &format!("{fqn}.{}", inner.name), rich, transitions),
                ChartNode::Connector(_) => out.push_str("rfsm.conn {}"),
            }
            out.push_str(",\n");
        }
        out.push('}');
    }
    let mut out = format!("{PREAMBLE}return ");
    state(&mut out, &model.root, "root", rich, &mut 0);
    out
}

/// Both do the same with the same lines. Answers what became of it, and how often functions were called.
fn side_by_side(bytes: &[u8], functions: &[u8], script: &[u8]) -> Result<(&'static str, usize), TestCaseError> {
    let model = chart(bytes);
    let mut maker = Maker { choices: Choices(functions, 0), rich: Rich::default(), programs: 0, transitions: 0 };
    maker.state(&model.root, "root");
    let Some(mut naive) = Naive::with(&model, maker.rich.clone()).filter(|naive| !naive.has_circle(false)) else {
        return Ok(("refused", 0));
    };
    let text = lua(&model, &maker.rich);
    let from = Sources::memory([("model.lua", text.as_str())]);
    let options = LoadOptions { trusted: true, ..LoadOptions::default() };
    let loaded = load_coordinator(&from, Path::new("model.lua"), &options);
    prop_assert!(loaded.coordinator.is_some(), "{:?}\n{}", loaded.findings, text);
    let written = loaded.coordinator.expect("looked at");
    let Some(program) = loaded.program else { return Ok(("pure", 0)) };
    let (compiled, findings) = compile(&written);
    prop_assert!(compiled.is_some(), "{:?}\n{}", findings, text);
    let compiled = compiled.expect("looked at");
    let opened = Opener::new(program, Arc::new(written)).open(None);
    prop_assert!(opened.is_ok(), "{:?}\n{}", opened, text);
    let mut sim = Sim::with(&compiled, opened.expect("looked at"));
    let (mut outcome, mut calls) = ("never entered", 0);
    for (number, byte) in script.iter().enumerate() {
        let set: Vec<&str> = (0..4).filter(|bit| byte >> bit & 1 == 1).map(|bit| EVENTS[bit]).collect();
        let (line, expected) = match byte >> 4 {
            0 | 1 => {
                naive.advance(i128::from(1 + byte % 4) * 400_000_000);
                (format!("advance {}", f64::from(1 + byte % 4) * 0.4), naive.step(1, &[], 1_000))
            }
            2 | 3 => ("run".to_owned(), naive.step(u64::MAX, &[], 100)),
            4 => ("nobody e_done@root.a".to_owned(), naive.step(1, &["nobody", "e_done@root.a"], 1_000)),
            5..=7 => (String::new(), naive.step(1, &[], 1_000)),
            _ => (set.join(" "), naive.step(1, &set, 1_000)),
        };
        let Some(idle) = expected.filter(|_| naive.said.len() < SAID) else { return Ok(("endless", calls)) };
        let seen = sim.line(&line).expect("a line");
        let active = naive.active();
        // What functions print; the simulator's own remarks are between.
        let own = |note: &&String| {
            note.starts_with(|c: char| c.is_ascii_digit()) || note.starts_with("ERR ") || note.starts_with("WARN ")
        };
        let notes: Vec<&String> = seen.notes.iter().filter(own).collect();
        let said: Vec<&String> = naive.said.iter().collect();
        prop_assert_eq!(&notes[..], &said[..], "line {} `{}` of {}", number, line, text);
        let ours = (&seen.actions[..], &seen.active[..], &seen.queue[..], seen.transition, seen.idle);
        let theirs = (&naive.actions[..], &active[..], naive.queue(), naive.transition, idle);
        prop_assert_eq!(ours, theirs, "line {} `{}` of {}", number, line, text);
        prop_assert_eq!(seen.mode, naive.leaf_mode(), "line {} `{}` of {}", number, line, text);
        calls += naive.said.len();
        if !active.is_empty() {
            outcome = "run";
        }
    }
    Ok((outcome, calls))
}

#[test]
fn functions_are_called_when_and_with_what_the_naive_interpreter_calls_them() {
    let (ran, calls, all) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: crate::random::cases() / 5,
        failure_persistence: None,
        ..ProptestConfig::default()
    });
    let bytes = proptest::collection::vec(any::<u8>(), 0..160);
    let functions = proptest::collection::vec(any::<u8>(), 0..160);
    let script = proptest::collection::vec(any::<u8>(), 1..16);
    let result = runner.run(&(bytes, functions, script), |(bytes, functions, script)| {
        let (outcome, called) = side_by_side(&bytes, &functions, &script)?;
        all.set(all.get() + 1);
        ran.set(ran.get() + u32::from(outcome == "run"));
        calls.set(calls.get() + called);
        Ok(())
    });
    if let Err(error) = result {
        panic!("{error}");
    }
    println!("{} of {} charts ran, {} calls", ran.get(), all.get(), calls.get());
    assert!(ran.get() * 4 > all.get(), "only {} of {} charts ran: the test has become empty", ran.get(), all.get());
    assert!(calls.get() > 2 * ran.get() as usize, "only {} calls in {} charts", calls.get(), ran.get());
}
