//! What is known of a push is what it comes to.

use super::*;
use crate::stack::PlannedPushes;

fn asked(world: &World, asks: &[Ask], configurations: &[Configuration], pushes: Option<PushesOf<'_>>) -> Group {
    let request = |ask: &Ask| Request { force: true, ..Request::new(RequestId(1), *ask, Requester::Operator) };
    taken_up(world, &asks.iter().map(request).collect::<Vec<_>>(), configurations, true, pushes)
}

/// Also for what follows it in the same batch, and where it is refused.
#[test]
fn a_push_that_is_known_comes_to_what_it_would_be_planned_to() {
    let mut bench = Bench::new(64);
    let stopped = [("A", Wanted::Stopped)];
    let below = conf("below", None, &[], vec![set("B.gain", 1.0)], &[]);
    let stops = conf("stops", None, &stopped, vec![set("A.mass", 2.0)], &[]);
    let needs = conf("needs", None, &[], vec![set("A.mass", 3.0)], &[]);
    bench.ok(&[push(&below)]);
    let world = World::new(bench.system.clone(), bench.stack.clone());
    let all = [below.clone(), stops.clone(), needs.clone()];
    let (apply, undo) = (|of: &Configuration| Ask::Apply(of.id), |of: &Configuration| Ask::UndoOf(of.id));
    let pushes = PlannedPushes::default();
    let (mut planned, mut refused) = (0, 0);
    for _ in 0..3 {
        for asks in [
            vec![apply(&stops)],
            vec![apply(&needs)],
            vec![apply(&stops), apply(&needs)],
            vec![apply(&needs), apply(&stops)],
            vec![undo(&below), apply(&stops)],
            vec![apply(&stops), undo(&below), apply(&needs)],
        ] {
            let group = asked(&world, &asks, &all, None);
            let known = asked(&world, &asks, &all, Some(pushes.of(7)));
            let told = |group: &Group| -> Vec<_> { group.told.iter().map(|told| (told.place, told.verdict)).collect() };
            assert_eq!((told(&known), &known.places), (told(&group), &group.places), "{asks:?}");
            let both = (known.planned.as_ref(), group.planned.as_ref());
            let parts = |group: Option<&Planned>| group.map(|planned| planned.parts.clone());
            assert_eq!(parts(both.0), parts(both.1), "{asks:?}");
            let steps = |group: Option<&Planned>| group.map(|planned| (planned.steps.clone(), planned.whole.clone()));
            assert_eq!(steps(both.0), steps(both.1), "{asks:?}");
            planned += usize::from(group.planned.is_some());
            refused += group.told.len();
        }
    }
    assert!(planned > 12 && refused > 3, "{planned} {refused}");
}
