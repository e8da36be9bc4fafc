//! What the engine adds to a model's own functions: one transition with guard, exit, effect and entry, against the same four
//! functions called alone. The bound is 1.2 times their time plus 1 µs.

use davit::functions::Opener;
use davit::lang::{LoadOptions, Sources, load_coordinator};
use davit::model::EventName;
use davit::statechart::{Hook, Machine, compile};
use davit::time::{Clock, Time};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// The functions, as expressions; `WORK` turns of a small loop each.
const WORK: usize = 100;

fn body(arguments: &str) -> String {
    format!("function({arguments}) local x = 0 for i = 1, {WORK} do x = x + i * i end return x > 0 end")
}

/// The least time of a round, in nanoseconds.
#[allow(clippy::disallowed_methods)] // measures real time
fn nanos_each(rounds: u32, mut round: impl FnMut()) -> f64 {
    let mut best = f64::MAX;
    for _ in 0..9 {
        let start = Instant::now();
        for _ in 0..rounds {
            round();
        }
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / f64::from(rounds));
    }
    best
}

fn main() {
    let (state, guard, effect) = (body("fsm, state, what"), body("tr, events"), body("fsm, tr, what, events"));
    let text = format!(
        "local entry, exit, guard, effect = {state}, {state}, {guard}, {effect}
         return rfsm.state {{
           a = rfsm.state {{ entry = entry, exit = exit }}, b = rfsm.state {{ entry = entry, exit = exit }},
           rfsm.trans {{ src = 'initial', tgt = 'a' }},
           rfsm.trans {{ src = 'a', tgt = 'b', events = {{ 'e' }}, guard = guard, effect = effect }},
           rfsm.trans {{ src = 'b', tgt = 'a', events = {{ 'e' }}, guard = guard, effect = effect }} }}"
    );
    let from = Sources::memory([("model.lua", text)]);
    let options = LoadOptions { trusted: true, ..LoadOptions::default() };
    let loaded = load_coordinator(&from, Path::new("model.lua"), &options);
    let written = loaded.coordinator.unwrap_or_else(|| panic!("{:?}", loaded.findings));
    let chart = compile(&written).0.expect("it compiles");
    let opener = Opener::new(loaded.program.expect("functions"), Arc::new(written));
    let mut functions = opener.open(Some(Clock::real())).expect("it opens");
    let mut machine = Machine::new(&chart);
    machine.run(&chart, Time::default(), &mut functions);
    let event = functions.event(&chart, EventName::new("e").expect("a name"));
    let mut steps = 0_u64;
    let step = nanos_each(20_000, || {
        machine.drop_queue();
        machine.send(event);
        let stepped = machine.step(&chart, Time::default(), 1, &mut functions);
        steps += u64::from(stepped.transition);
    });
    assert_eq!(steps, 9 * 20_000, "every event takes a transition");

    let lua = mlua::Lua::new();
    let make = |text: &str| lua.load(format!("return {text}")).eval::<mlua::Function>().expect("a function");
    let (state, guard, effect) = (make(&state), make(&guard), make(&effect));
    let (fsm, tr, events) = (lua.create_table().unwrap(), lua.create_table().unwrap(), lua.create_table().unwrap());
    events.raw_push("e").unwrap();
    let word = lua.create_string("entry").unwrap();
    let alone = nanos_each(20_000, || {
        let _: mlua::Value = guard.call((&tr, &events)).unwrap();
        state.call::<()>((&fsm, &tr, &word)).unwrap();
        effect.call::<()>((&fsm, &tr, &word, &events)).unwrap();
        state.call::<()>((&fsm, &tr, &word)).unwrap();
    });
    let bound = 1.2 * alone + 1_000.0;
    println!(
        "step {step:.0} ns, functions alone {alone:.0} ns, ratio {:.2}, bound {bound:.0} ns: {}",
        step / alone,
        if step <= bound { "kept" } else { "NOT kept" }
    );
}
