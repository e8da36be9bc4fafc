//! `davit.Monitors`: the monitors of a deployment, as a component of the system.
//!
//! It evaluates them in the rounds of its activity. Each monitor is a property of it, true while it is enabled: a
//! configuration enables one by setting it, and its undo restores what was. What a monitor looks at need not exist, nor
//! be connected: the component has probes of it.

use crate::model::monitor::MONITORS_TYPE;
use crate::model::{Monitor, TypeName};
use crate::monitor::{Bank, InputSample, Troubles};
use crate::runtime::{
    Builder, Component, ComponentFactory, Context, EventOut, Libraries, Library, Out, Probes, Prop, Sight,
};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The library with the component types that evaluate `monitors`: one for those of each file.
pub fn library(monitors: &[Monitor]) -> Library {
    let mut files: BTreeMap<TypeName, Vec<Monitor>> = BTreeMap::new();
    for monitor in monitors {
        files.entry(monitor.run_by()).or_default().push(monitor.clone());
    }
    if files.is_empty() {
        files.insert(TypeName::new(MONITORS_TYPE).expect("the name of a type"), Vec::new());
    }
    files.into_iter().fold(Library::new("davit"), |library, (ty, monitors)| {
        let plan = Arc::new(MonitorPlan::new(&monitors));
        library.with_kind(ComponentFactory::made_by(ty.as_str(), move |b| Monitors::new_of(&plan, b)))
    })
}

/// The libraries of a deployment with these monitors: with one more if there are any.
#[must_use]
pub fn added_to(libraries: Libraries, monitors: &[Monitor]) -> Libraries {
    if monitors.is_empty() { libraries } else { libraries.with(library(monitors)) }
}

/// What all instances share.
struct MonitorPlan {
    monitors: Vec<Monitor>,
    bank: Bank,
    sight: Sight,
}

impl MonitorPlan {
    fn new(monitors: &[Monitor]) -> Self {
        let bank = Bank::new(monitors);
        let sight = Sight::of(bank.inputs());
        Self { monitors: monitors.to_vec(), bank, sight }
    }
}

/// The monitors at work.
struct Monitors {
    plan: Arc<MonitorPlan>,
    bank: Bank,
    enabled: Vec<Prop<bool>>,
    is_enabled: Vec<bool>,
    probes: Probes,
    samples: Vec<InputSample>,
    events: EventOut,
    verdicts: Vec<Out<bool>>,
    robustness: Vec<Out<f64>>,
    troubles: Troubles,
    not_numbers: Out<i64>,
    went_backwards: Out<i64>,
    merged: Out<i64>,
    /// Begins anew with the next update.
    fresh: bool,
}

impl Component for Monitors {
    fn new(_: &mut Builder<Self>) -> Self {
        unreachable!("it is made by `new_of`, which knows the monitors")
    }

    fn update(&mut self, cx: &mut Context) {
        let now = cx.now();
        for (i, enabled) in self.enabled.iter_mut().enumerate() {
            let on = enabled.get();
            if self.fresh || on != self.is_enabled[i] {
                // A monitor that is enabled has no history, and neither has one whose component was stopped.
                self.bank.enable(i, false, now);
                self.bank.enable(i, on, now);
                self.is_enabled[i] = on;
            }
        }
        self.fresh = false;
        self.plan.sight.look(&mut self.probes, now, &mut self.samples);
        let (samples, events) = (&self.samples, &mut self.events);
        self.bank.step(now, &mut |input| samples[input], &mut |_, event| events.raise(event));
        for (i, (verdict, robustness)) in self.verdicts.iter_mut().zip(&mut self.robustness).enumerate() {
            // Who is connected to it must not go on with what was true before it was switched off.
            verdict.write(self.bank.is_true(i).unwrap_or(false));
            if let Some(margin) = self.bank.robustness(i) {
                robustness.write(margin);
            }
        }
        let troubles = self.bank.troubles();
        if troubles != self.troubles {
            let count = |n: u64| i64::try_from(n).unwrap_or(i64::MAX);
            self.not_numbers.write(count(troubles.not_numbers));
            self.went_backwards.write(count(troubles.backwards));
            self.merged.write(count(troubles.merged));
            self.troubles = troubles;
        }
    }
}

impl Monitors {
    fn new_of(plan: &Arc<MonitorPlan>, b: &mut Builder<Self>) -> Self {
        b.describe(
            "The deployment's monitors. Each is a property, true while it is enabled, with its verdict and how far it is \
             from the other one as ports. Enabled again, a monitor begins with an empty history.",
        )
        .on_start(|c, _| {
            c.fresh = true;
            Ok(())
        });
        let events = b.doc("What the monitors raise.").event_output("events");
        let (mut enabled, mut verdicts, mut robustness) = (Vec::new(), Vec::new(), Vec::new());
        for monitor in &plan.monitors {
            let name = monitor.name.last();
            let raises = || monitor.raise.map_or_else(|| "Watches.".to_owned(), |event| format!("Raises `{event}`."));
            let doc = monitor.description.clone().unwrap_or_else(raises);
            enabled.push(b.doc(&doc).property(name, monitor.enabled));
            verdicts.push(b.doc("Whether it is enabled and its condition true.").output(&format!("is_{name}")));
            // By their beginnings: two monitors, whatever they are called, never have ports of one name.
            let margin = format!("robustness_of_{name}");
            robustness
                .push(b.doc("How far the condition is from changing: positive while it is true.").output(&margin));
        }
        let not_numbers =
            b.doc("Samples so far that were no number: comparisons with them are false.").output("not_numbers");
        let went_backwards =
            b.doc("Times so far that went backwards; the time before was taken.").output("went_backwards");
        let merged = b
            .doc(
                "Changes so far that were told apart no more, because the memory of a condition over time was used up.",
            )
            .output("merged");
        let probes = b.probes(plan.sight.wanted().clone());
        Self {
            plan: plan.clone(),
            bank: plan.bank.clone(),
            is_enabled: vec![false; enabled.len()],
            enabled,
            probes,
            samples: vec![InputSample::default(); plan.bank.inputs().len()],
            events,
            verdicts,
            robustness,
            troubles: Troubles::default(),
            not_numbers,
            went_backwards,
            merged,
            fresh: true,
        }
    }
}
