//! What a file did to a subsystem, when that takes it away.

use super::*;

fn by<'c>(configuration: &'c Configuration, coordinator: &str) -> Op<'c> {
    push_by(configuration, Requester::Coordinator(ComponentName::new(coordinator).unwrap()))
}

/// Two subsystems with an arm each, made by their own coordinators.
fn two(bound: usize) -> (Bench, [FrameId; 2]) {
    let mut bench = Bench { system: System::new(types()), stack: Stack::new(bound) };
    let made = ["s", "t"].map(|path| {
        let make = conf(&format!("{path}/make"), None, &[], vec![create(&format!("{path}/A"), "t.Arm")], &[]);
        bench.ok(&[by(&make, path)]).1[0]
    });
    (bench, made)
}

/// Of what was squashed, too, that is void which a subsystem has taken away, and the rest is undone.
#[test]
fn what_was_squashed_is_void_where_it_was_done() {
    let (mut bench, [s, _]) = two(2);
    for n in 1..5 {
        let value = f64::from(n);
        let tune = conf(&format!("tune{n}"), None, &[], vec![set("s/A.gain", value), set("t/A.gain", value)], &[]);
        bench.ok(&[by(&tune, "root")]);
    }
    assert_eq!(bench.stack.len(), 4);
    assert!(bench.stack.frames().iter().any(|frame| frame.is_squashed()));
    let (steps, _) = bench.ok(&[Op::Undo(s)]);
    assert_eq!(steps, ["destroy s/A"]);
    assert!(bench.stack.frames().iter().all(|frame| frame.inside() == "t"));
    bench.ok(&[Op::UndoTop]);
    assert!((bench.value("t/A.gain") - 3.0).abs() < 1e-9);
    let (steps, _) = bench.ok(&[Op::UndoTop]);
    assert_eq!((steps, bench.stack.len()), (vec!["property_set t/A.gain = 0.0".to_owned()], 1));
}

/// A configuration of the subsystem that takes it away does the same as an undo, once it is done and not before; and what comes back has
/// nothing of what was.
#[test]
fn what_a_configuration_takes_away_is_void_when_that_is_done() {
    let (mut bench, _) = two(8);
    let tune = conf("tune", None, &[], vec![set("s/A.gain", 1.0), set("t/A.gain", 1.0)], &[]);
    let tuned = bench.ok(&[by(&tune, "root")]).1[0];
    let drop =
        conf("s/drop", None, &[], vec![ChangeKind::Destroy { component: ComponentName::new("s/A").unwrap() }], &[]);
    let planned = bench.ask(&[by(&drop, "s")]).unwrap();
    assert!(bench.stack.frame(tuned).unwrap().inside().is_empty(), "nothing is done yet");
    std::mem::drop(planned);
    bench.ok(&[by(&drop, "s")]);
    bench.ok(&[Op::UndoTop]);
    assert!((bench.value("s/A.gain") - 1.0).abs() < 1e-9);
    let (steps, _) = bench.ok(&[Op::Undo(tuned)]);
    assert_eq!(steps, ["property_set t/A.gain = 0.0"]);
}

/// What is safe is for all inside: it holds what it touched, and its floor too.
#[test]
fn a_safe_configuration_of_an_outer_file_holds_what_it_touched() {
    for (change, code) in [(set("s/A.gain", 1.0), "stack::shared"), (call("s/A.weld"), "stack::floor")] {
        for safe in [false, true] {
            let (mut bench, [s, _]) = two(8);
            let mut halt = conf("halt", None, &[], vec![change.clone()], &[]);
            halt.safe = safe;
            bench.ok(&[push(&halt)]);
            match safe {
                true => assert_eq!(bench.codes(&[Op::Undo(s)]), [code]),
                // With nothing left of it, it is gone.
                false => {
                    bench.ok(&[Op::Undo(s)]);
                    assert_eq!(bench.stack.len(), 1);
                }
            }
        }
    }
}

/// What an operator has done in one subsystem is not made permanent by what cannot be undone in another one, nor kept from it.
#[test]
fn a_floor_of_one_subsystem_is_none_of_another() {
    let (mut bench, _) = two(8);
    let weld = conf("t/weld", None, &[], vec![call("t/A.weld")], &[]);
    let soft = conf("s/soft", None, &[], vec![set("s/A.gain", 1.0)], &[]);
    bench.ok(&[push(&soft)]);
    bench.ok(&[push(&weld)]);
    bench.stack.make_permanent(Requester::Operator);
    assert_eq!(bench.stack.len(), 3, "it holds back what its own coordinator made");
    let names = |bench: &Bench| bench.stack.frames().iter().map(|f| f.configuration.to_string()).collect::<Vec<_>>();
    assert_eq!(names(&bench), ["s/make", "t/make", "t/weld"]);
}

/// What comes back in the place of what was taken away is another one: what was done to that is not undone on it.
#[test]
fn what_was_done_to_one_is_not_undone_on_the_one_before_it() {
    let (mut bench, _) = two(8);
    let swap = ChangeKind::Replace {
        component: ComponentName::new("s/A").unwrap(),
        ty: TypeName::new("t.Arm").unwrap(),
        activity: None,
        properties: BTreeMap::from([(ident("gain"), Value::Float(5.0))]),
        map: BTreeMap::new(),
    };
    let swap = conf("s/swap", None, &[], vec![swap], &[]);
    let swapped = bench.ok(&[by(&swap, "s")]).1[0];
    let tune = conf("tune", None, &[], vec![set("s/A.gain", 1.0), set("t/A.gain", 1.0)], &[]);
    let tuned = bench.ok(&[by(&tune, "root")]).1[0];
    bench.ok(&[Op::Undo(swapped)]);
    assert!(bench.value("s/A.gain").abs() < 1e-9);
    let (steps, _) = bench.ok(&[Op::Undo(tuned)]);
    assert_eq!(steps, ["property_set t/A.gain = 0.0"]);
}

/// A call that another subsystem would take back is void with either of the two.
#[test]
fn a_call_is_void_with_what_would_take_it_back() {
    for (of, undo) in [("s/A.open", "t/A.close"), ("t/A.open", "s/A.close")] {
        for bound in [2, 8] {
            let (mut bench, [s, _]) = two(bound);
            for n in 0..3 {
                let call = |operation: &str| Call { operation: member(operation), args: vec![] };
                let kind = ChangeKind::OperationCall { call: call(of), undo: Some(call(undo)) };
                let both = conf(&format!("both{n}"), None, &[], vec![kind, set("t/A.gain", f64::from(n))], &[]);
                bench.ok(&[by(&both, "root")]);
            }
            bench.ok(&[Op::Undo(s)]);
            while bench.stack.len() > 1 {
                let (steps, _) = bench.ok(&[Op::UndoTop]);
                assert!(steps.iter().all(|step| step.starts_with("property_set t/A.gain")), "{steps:?}");
            }
            assert!(bench.value("t/A.gain").abs() < 1e-9);
        }
    }
}
