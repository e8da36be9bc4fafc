//! Diff: apply(a, diff(a, b)) = b, and diff(a, a) is empty.

use crate::generate;
use crate::plain::Plain;
use crate::settings;
use davit::model::RunState;
use davit::system::{System, View, diff, exclusive};
use proptest::prelude::*;

/// `b` as far as it can be reached from `a`: nothing brings about a fault.
fn reachable(a: &System, b: &System) -> davit::model::Snapshot {
    let from = a.snapshot();
    let mut to = b.snapshot();
    for (name, component) in &mut to.components {
        let was = from.components.get(name);
        if component.state == RunState::Faulted && was.is_none_or(|w| w.state != RunState::Faulted) {
            component.state = RunState::Unconfigured;
        }
    }
    to
}

proptest! {
    #![proptest_config(settings())]

    #[test]
    fn difference(
        types in generate::types(),
        common in generate::configs(0..3),
        left in generate::configs(0..3),
        right in generate::configs(0..3),
        faults in any::<(u8, u8)>(),
        written in prop::collection::vec(any::<(bool, u8, u8)>(), 0..4),
    ) {
        let catalogue = generate::catalogue(&types, true);
        let grow = |more: &[generate::ConfigGene], fault: u8| {
            let genes: Vec<_> = common.iter().chain(more).cloned().collect();
            let mut system = generate::grow(catalogue.clone(), &genes).0;
            if fault % 2 == 1 {
                let name = generate::name(fault / 2);
                // What another one holds it cannot have taken by failing.
                if system.component(name).is_some_and(|node| exclusive::taken(node, &system).is_none()) {
                    system.set_state(name, RunState::Faulted);
                }
            }
            // Written values, also under connections: written before they were made.
            let mut now = system.snapshot();
            for (_, port, value) in written.iter().filter(|(first, ..)| *first == (fault == faults.0)) {
                generate::write_under(&mut now, &catalogue, *port, *value);
            }
            System::from_snapshot(&now, catalogue.clone()).unwrap()
        };
        let (a, b) = (grow(&left, faults.0), grow(&right, faults.1));
        prop_assert!(diff(&a, &a).is_empty());
        prop_assert!(diff(&b, &b).is_empty());
        let mut plain = Plain::new(a.snapshot(), &catalogue);
        let steps = diff(&a, &b);
        for step in &steps {
            prop_assert!(plain.try_make(step), "{} of {:?}", step, steps);
        }
        let mut got = plain.is.clone();
        let mut wanted = reachable(&a, &b);
        // A component that is faulted in both is left alone, or is unconfigured when something else of it had to change.
        for (name, component) in &mut wanted.components {
            if component.state == RunState::Faulted
                && let Some(got) = got.components.get_mut(name)
                && got.state == RunState::Unconfigured
            {
                got.state = RunState::Faulted;
            }
        }
        prop_assert_eq!(&got, &wanted, "{:?}", steps);
        prop_assert_eq!(steps.is_empty(), a.snapshot() == reachable(&a, &b));
        // Teardown leaves nothing.
        let mut plain = Plain::new(b.snapshot(), &catalogue);
        for step in diff(&b, &System::new(catalogue.clone())) {
            prop_assert!(plain.try_make(&step), "{}", step);
        }
        prop_assert!(plain.is.is_empty());
    }
}
