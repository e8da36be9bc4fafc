//! What is squashed, and what stays by itself.

use super::*;

#[test]
fn frames_of_active_states_are_never_squashed() {
    let mut bench = Bench::new(3);
    let of = |n: usize| conf(&format!("c{n}"), None, &[], vec![set("A.gain", n as f64)], &[]);
    let scoped = of(1);
    let request =
        Op::Push { configuration: &scoped, requester: Requester::Operator, at: Time(0), scope: Some(Scope(1)) };
    let kept = bench.ok(&[request]).1[0];
    for n in 2..9 {
        bench.ok(&[push(&of(n))]);
    }
    assert_eq!(bench.stack.len(), 3);
    assert!(bench.stack.frame(kept).is_some_and(|f| !f.is_squashed()));
    let squashed = &bench.stack.frames()[1];
    assert_eq!((squashed.parts.len(), squashed.configuration.as_str()), (6, "c7"));
    assert!(bench.stack.is_buried(ConfigId::new("c3").unwrap(), Some(Requester::Operator)));
    // Left: popped from the bottom; the squashed frame takes its value over.
    bench.ok(&[Op::Undo(kept)]);
    bench.ok(&[Op::UndoTo(0)]);
    assert_eq!(bench.value("A.gain"), 0.0);
    // Nothing but active frames: refused.
    let mut bench = Bench::new(2);
    for n in 0..2 {
        let conf = of(n);
        bench.ok(&[Op::Push {
            configuration: &conf,
            requester: Requester::Operator,
            at: Time(0),
            scope: Some(Scope(1)),
        }]);
    }
    assert_eq!(bench.codes(&[push(&of(3))]), ["stack::full"]);
}

#[test]
fn the_safe_frame_in_force_is_squashed_last() {
    let mut bench = Bench::new(3);
    let safe = Configuration { safe: true, ..conf("safe", None, &[], vec![call("B.open")], &[]) };
    let of = |n: usize| conf(&format!("c{n}"), None, &[], vec![set("A.gain", n as f64)], &[]);
    let kept = bench.ok(&[push(&safe)]).1[0];
    for n in 0..9 {
        bench.ok(&[push(&of(n))]);
    }
    assert!(bench.stack.len() == 3 && bench.stack.frame(kept).is_some_and(|frame| !frame.is_squashed()));
    // One that is never undone is in nobody's way.
    let mut newest = kept;
    for n in 0..9 {
        bench.ok(&[push(&of(n))]);
        newest = bench.ok(&[push(&safe)]).1[0];
        assert!(bench.stack.len() <= 3);
    }
    bench.ok(&[push(&of(9))]);
    assert!(bench.stack.frame(newest).is_some_and(|frame| !frame.is_squashed()));
    bench.ok(&[Op::Undo(newest)]);
}

#[test]
fn what_holds_a_thing_is_not_squashed_past_who_let_it_go() {
    let mut bench = Bench::new(2);
    let c = Requester::Coordinator(ComponentName::new("c").unwrap());
    let has = |id: &str, of: &str| conf(id, None, &[], vec![create(of, "t.Bus")], &[(of, Wanted::Stopped)]);
    let of = |id: &str| conf(id, None, &[], vec![set("A.gain", 1.0)], &[]);
    bench.ok(&[push_by(&has("one", "X"), c)]);
    let gone = ChangeKind::Destroy { component: ComponentName::new("X").unwrap() };
    let free = bench.ok(&[push_by(&conf("free", None, &[], vec![gone], &[]), Requester::Operator)]).1[0];
    bench.ok(&[push_by(&has("other", "Y"), c)]);
    // The one that is undone would have to hold what `Y` holds.
    assert_eq!(bench.codes(&[Op::Undo(free)]), ["stack::shared"]);
    // `one` and `other` are not one at the place of `one`: neither could be undone then.
    bench.ok(&[push_by(&of("third"), c)]);
    assert!(bench.stack.len() == 3, "{:?}", bench.stack.frames());
    bench.ok(&[Op::UndoTo(0)]);
    assert!(bench.system.component(ComponentName::new("X").unwrap()).is_none());
}

#[test]
fn what_others_set_between_does_not_keep_frames_apart() {
    let mut bench = Bench::new(3);
    let by = |name: &str| Requester::Coordinator(ComponentName::new(name).unwrap());
    let of = |id: &str, gain: usize, other: f64| {
        conf(id, None, &[], vec![set("A.gain", gain as f64), set("B.gain", other)], &[])
    };
    for n in 0..8 {
        bench.ok(&[push_by(&of("mode", n, 0.5), by("c"))]);
        bench.ok(&[push_by(&conf("mine", None, &[], vec![set("A.gain", 10.0 + n as f64)], &[]), Requester::Operator)]);
    }
    assert_eq!(bench.stack.len(), 6);
    // What the operator has set lately is there without what the coordinator did, and the other way about.
    let all: Vec<FrameId> = bench.stack.frames().iter().map(|frame| frame.id).collect();
    let whose = |bench: &Bench, id| bench.stack.frame(id).is_some_and(|frame| frame.requester == Requester::Operator);
    for id in all.iter().rev().filter(|id| !whose(&bench, **id)).copied().collect::<Vec<_>>() {
        bench.ok(&[Op::Undo(id)]);
    }
    assert_eq!((bench.value("A.gain"), bench.value("B.gain")), (17.0, 0.0));
    bench.ok(&[Op::UndoTo(0)]);
    assert_eq!(bench.value("A.gain"), 0.0);
    // Written by the older one and between, not again by the newer one, which shares something else with what is between.
    let mut bench = Bench::new(2);
    let [low, high] =
        [("low", "A.gain"), ("high", "B.gain")].map(|(id, of)| conf(id, None, &[], vec![set(of, 1.0)], &[]));
    for own in [&low, &high] {
        bench.ok(&[push_by(own, by("c"))]);
        bench.ok(&[push_by(&of("mine", 2, 2.0), Requester::Operator)]);
    }
    let refused = bench.ask(&[push_by(&low, by("c"))]).unwrap_err();
    let finding = &refused.findings[0];
    assert_eq!(
        (finding.code.0, finding.help.as_deref().unwrap_or_default()),
        (
            "stack::full",
            "undo or commit `mine` (a frame of operator), which lies between two of them, or raise `limits: { stack: … }` in the deployment"
        )
    );
}

#[test]
fn calls_that_pile_up_become_a_floor() {
    let mut bench = Bench::new(2);
    for n in 0..crate::limits::SQUASHED_CALLS + 4 {
        bench.ok(&[push(&conf(&format!("c{}", n % 8), None, &[], vec![call("A.open")], &[]))]);
    }
    let oldest = &bench.stack.frames()[0];
    assert!(oldest.floor.as_ref().is_some_and(|why| why.contains("operation calls")));
    bench.ok(&[Op::UndoTop]);
    assert_eq!(bench.codes(&[Op::UndoTop]), ["stack::floor"]);
}

#[test]
fn a_switch_to_and_fro_stays_bounded_when_squashed() {
    let mut bench = Bench::new(2);
    let (stopped, running) = ([("A", Wanted::Stopped)], [("A", Wanted::Running)]);
    for n in 0..200 {
        bench.ok(&[push(&conf("c", None, &stopped, vec![set("A.mass", f64::from(n % 3))], &running))]);
    }
    let super::super::Inverse::List(list) = &bench.stack.frames()[0].inverse else { panic!("it is squashed") };
    assert_eq!(
        list.iter().map(|i| i.step.to_string()).collect::<Vec<_>>(),
        ["stop A", "property_set A.mass = 0.0", "start A"]
    );
}

#[test]
fn a_frame_that_waits_for_its_confirmation_is_not_squashed() {
    let mut bench = Bench::new(2);
    let mut waits = conf("waits", None, &[], vec![set("A.gain", 1.0)], &[]);
    let event = EventName::new("e_fine").unwrap();
    waits.confirm = Some(Confirm { event, within: std::time::Duration::from_secs(1) });
    let plain = conf("plain", None, &[], vec![set("B.gain", 1.0)], &[]);
    let more = conf("more", None, &[], vec![set("B.mass", 1.0)], &[("B", Wanted::Stopped)]);
    let more = Configuration { pre: more.post.clone(), ..more };
    assert!(bench.ask(&[push(&waits)]).unwrap().parts[0].edits.waits);
    let held = bench.ok(&[push(&waits)]).1;
    let second = bench.ask(&[push(&plain)]).unwrap();
    bench.stack.apply(second.parts.iter().map(|part| &part.edits), &held);
    let third = bench.ask(&[push(&more)]).unwrap();
    bench.stack.apply(third.parts.iter().map(|part| &part.edits), &held);
    let parts: Vec<usize> = bench.stack.frames().iter().map(|frame| frame.parts.len()).collect();
    assert_eq!(parts, [0, 2], "it stays by itself");
}

#[test]
fn what_can_be_undone_beside_others_still_can() {
    let mut bench = Bench::new(2);
    let by = |name: &str| Requester::Coordinator(ComponentName::new(name).unwrap());
    let of = |id: &str, operation: &str| conf(id, None, &[], vec![call(operation)], &[]);
    bench.ok(&[push_by(&of("low", "A.open"), by("c"))]);
    bench.ok(&[push_by(&of("mine", "B.open"), Requester::Operator)]);
    // Of another file: no hindrance to `low`, which above it would be one to it.
    let foreign = bench.ok(&[push_by(&of("s/mine", "A.open"), Requester::Operator)]).1[0];
    bench.ok(&[push_by(&of("high", "B.open"), by("c"))]);
    bench.ok(&[push_by(&of("high", "B.open"), by("c"))]);
    assert_eq!(bench.stack.len(), 4);
    bench.ok(&[Op::Undo(foreign)]);
}

/// Whoever follows thousands of stacks has what takes the same frames back once, whatever their numbers are.
#[test]
fn what_differs_in_numbers_alone_is_squashed_once() {
    let mut bench = Bench::new(2);
    bench.stack = Stack::remembering(2);
    let of = |n: usize| conf(&format!("c{n}"), None, &[], vec![set("A.gain", n as f64)], &[]);
    for n in 1..3 {
        bench.ok(&[push(&of(n))]);
    }
    // The same frames with other numbers.
    let mut other = bench.stack.clone();
    let mut next = 100;
    other.share(|frame| {
        next += 1;
        Some(Arc::new(super::super::Frame { id: FrameId(next), ..(**frame).clone() }))
    });
    let third = of(3);
    let planned = bench.ask(&[push(&third)]).expect("it fits");
    other.commit(planned);
    bench.ok(&[push(&third)]);
    let (a, b) = (&bench.stack.frames()[0], &other.frames()[0]);
    assert!(a.is_squashed() && a.id != b.id && b.id == FrameId(102), "{:?} {:?}", a.id, b.id);
    assert!(Arc::ptr_eq(&a.footprint, &b.footprint));
    assert_eq!(super::super::Frame { id: a.id, ..(**b).clone() }, **a);
}

/// Whoever goes round and round has once what all of it touches, and of what it was made.
#[test]
fn what_adds_nothing_shares_what_is_there() {
    let mut bench = Bench::new(2);
    let of = |n: usize| conf(&format!("c{n}"), None, &[], vec![set("A.gain", n as f64)], &[]);
    let mut bottom = Vec::new();
    for n in [1, 2, 1, 2, 1] {
        bench.ok(&[push(&of(n))]);
        bottom.push(bench.stack.frames()[0].clone());
    }
    let [.., before, after] = &bottom[..] else { unreachable!("five were pushed") };
    assert!(before.is_squashed() && before.id != after.id);
    assert!(Arc::ptr_eq(&before.footprint, &after.footprint) && Arc::ptr_eq(&before.parts, &after.parts));
    bench.ok(&[push(&conf("more", None, &[], vec![set("B.gain", 1.0)], &[])), push(&of(1))]);
    let more = &bench.stack.frames()[0];
    assert!(more.footprint.touches.len() > after.footprint.touches.len() && more.parts.len() > after.parts.len());
}

/// Of two that have the same line for themselves, one after the other, what is taken back in between is not left out.
#[test]
fn who_takes_what_another_let_go_is_led_back_first() {
    let mut bench = Bench::new(2);
    let with = |number: i64| ChangeKind::PropertySet { property: member("C.number"), value: Value::Int(number) };
    let other = [("C", Wanted::Unconfigured)];
    let running = [("C", Wanted::Running)];
    let (c, d) = (create("C", "t.Line"), create("D", "t.Line"));
    bench.ok(&[push(&conf("up", None, &[], vec![c, d], &[]))]);
    bench.ok(&[push(&conf("go", None, &[], vec![with(1)], &[running[0], ("D", Wanted::Running)]))]);
    bench.stack.make_permanent(Requester::Operator);
    let before = bench.system.snapshot();
    let again = conf("again", None, &other, vec![with(2)], &running);
    let away = conf("away", None, &[], vec![], &[("D", Wanted::Unconfigured)]);
    let takes = conf("takes", None, &other, vec![with(0)], &running);
    for configuration in [&again, &away, &takes] {
        bench.ok(&[push(configuration)]);
    }
    for n in 1..4 {
        bench.ok(&[push(&conf(&format!("c{n}"), None, &[], vec![set("A.gain", f64::from(n))], &[]))]);
    }
    assert!(bench.stack.len() == 2 && bench.stack.frames()[0].is_squashed());
    // Going round leaves no more behind than going once.
    let longest =
        |bench: &Bench| bench.stack.frames().iter().map(|frame| super::super::squash::list(frame).len()).max();
    let once = longest(&bench);
    for _ in 0..20 {
        let back = conf("back", None, &other, vec![with(2)], &running);
        let on = conf("on", None, &[], vec![], &[("D", Wanted::Running)]);
        for configuration in [&back, &on, &away, &takes] {
            bench.ok(&[push(configuration)]);
        }
    }
    // The last round is squashed, too.
    for n in 4..6 {
        bench.ok(&[push(&conf(&format!("c{n}"), None, &[], vec![set("A.gain", f64::from(n))], &[]))]);
    }
    assert!(longest(&bench) <= once, "{:?} {once:?}", longest(&bench));
    bench.ok(&[Op::UndoTo(0)]);
    assert_eq!(bench.system.snapshot(), before);
}
