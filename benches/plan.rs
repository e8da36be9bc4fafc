//! What planning costs: a switch in a small and a large system, deployments of growing size, a prepared switch.
//!
//! `cargo bench --bench plan`

#[path = "../tests/support/names.rs"]
mod names;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use davit::model::*;
use davit::plan::{PlanContext, plan};
use davit::stack::{Op, Requester, ResolvedStep, Stack, Switch, transaction};
use davit::system::{System, step};
use davit::time::Time;
use names::ident;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::sync::Arc;

fn catalogue() -> Arc<Catalogue> {
    let mut ty = ComponentType::new("bench.Gain", "one in, one out, three properties");
    for (name, direction) in [("u", Direction::In), ("y", Direction::Out), ("mode", Direction::In)] {
        let port = PortType {
            direction,
            ty: ValueType::Float,
            unit: None,
            buffered: false,
            required: false,
            doc: String::new(),
            origin: Origin::NONE,
        };
        ty.ports.insert(ident(name), port);
    }
    for (name, value) in [("k", Value::Float(1.0)), ("gain", Value::floats(&[1.0; 3])), ("on", Value::Bool(false))] {
        let property = PropertyType {
            ty: if name == "k" {
                "float"
            } else if name == "on" {
                "bool"
            } else {
                "float[3]"
            }
            .parse()
            .expect("a type"),
            default: Some(value),
            min: None,
            max: None,
            tunable: Tunable::Stopped,
            raises: false,
            unit: None,
            doc: String::new(),
            origin: Origin::NONE,
        };
        ty.properties.insert(ident(name), property);
    }
    let mut catalogue = Catalogue::new();
    catalogue.insert(ty);
    Arc::new(catalogue)
}

fn change(kind: ChangeKind) -> Change {
    Change { kind, origin: Origin::NONE }
}

fn name(i: usize) -> ComponentName {
    ComponentName::new(&format!("c{i}")).expect("a name")
}

/// A chain of `n` components, running.
fn deployment(n: usize) -> Configuration {
    let mut conf = Configuration::new(ConfigId::new("deploy").expect("a name"));
    let ty = TypeName::new("bench.Gain").expect("a name");
    for i in 0..n {
        let component = name(i);
        conf.changes.push(change(ChangeKind::Create { component, ty, activity: None, properties: BTreeMap::new() }));
        if i > 0 {
            let (from, to) = (name(i - 1).member(ident("y")), component.member(ident("u")));
            conf.changes.push(change(ChangeKind::Connect { from, to, policy: Policy::Data }));
        }
    }
    conf.post.push(StateEntry { target: Target::Default, state: Wanted::Running, origin: Origin::NONE }).unwrap();
    conf
}

fn deployed(n: usize) -> System {
    let mut system = System::new(catalogue());
    let plan = plan(&system, &deployment(n), &PlanContext::default()).expect("a chain is accepted");
    for s in &plan.steps {
        step::apply(&s.step, &mut system).expect("a planned step is allowed");
    }
    system
}

/// Stop, set a 3-vector, write a port, start.
fn switch(id: &str, gain: f64) -> Configuration {
    let mut conf = Configuration::new(ConfigId::new(id).expect("a name"));
    let target = Target::Component(name(3));
    conf.pre.push(StateEntry { target, state: Wanted::Stopped, origin: Origin::NONE }).unwrap();
    let property = name(3).member(ident("gain"));
    conf.changes.push(change(ChangeKind::PropertySet { property, value: Value::floats(&[gain; 3]) }));
    conf.changes.push(change(ChangeKind::PortWrite { port: name(3).member(ident("mode")), value: Value::Float(gain) }));
    conf.post.push(StateEntry { target, state: Wanted::Running, origin: Origin::NONE }).unwrap();
    conf
}

fn switches(c: &mut Criterion) {
    let mut group = c.benchmark_group("switch");
    for n in [10, 10_000] {
        let system = deployed(n);
        let conf = switch("switch", 2.0);
        group.bench_with_input(BenchmarkId::new("plan", n), &n, |b, _| {
            b.iter(|| plan(black_box(&system), &conf, &PlanContext::default()).expect("accepted"));
        });
        let mut system = deployed(n);
        let mut stack = Stack::new(64);
        let context = PlanContext::default();
        let push = |configuration| Op::Push { configuration, requester: Requester::Operator, at: Time(0), scope: None };
        let (eight, five) = (switch("eight", 2.0), switch("five", 3.0));
        let first = transaction(&system, &stack, &[push(&eight)], &context).expect("accepted");
        for s in first.steps.iter() {
            step::apply(&s.step, &mut system).expect("allowed");
        }
        stack.commit(first);
        group.bench_with_input(BenchmarkId::new("net of undo and push", n), &n, |b, _| {
            b.iter(|| transaction(&system, &stack, &[Op::UndoTop, push(&five)], &context).expect("accepted"));
        });
    }
    for n in [10, 10_000] {
        let mut system = deployed(n);
        let mut stack = Stack::new(64);
        let configuration = switch("switch", 2.0);
        let (requester, at) = (Requester::Operator, Time(0));
        let push = Op::Push { configuration: &configuration, requester, at, scope: None };
        let planned = transaction(&system, &stack, &[push], &PlanContext::default()).expect("accepted");
        let mut prepared = Switch::new(&system, &configuration, &planned).expect("a fixed switch");
        drop(planned);
        let perform = |switch: &Switch, undoing, system: &mut System| {
            let mut done = 0;
            while let Some(ResolvedStep { step, place, value, .. }) = switch.step(done, undoing) {
                black_box(value);
                assert!(place.precondition(step, system).is_empty());
                place.effect(step, system);
                done += 1;
            }
        };
        group.bench_with_input(BenchmarkId::new("prepared, apply and undo", n), &n, |b, _| {
            b.iter(|| {
                assert!(stack.takes(&prepared, requester) && prepared.ready(&system, requester, at, None));
                perform(&prepared, false, &mut system);
                stack.push_switch(&mut prepared);
                assert!(stack.is_top(&prepared) && prepared.fits(&system, true));
                perform(&prepared, true, &mut system);
                stack.pop_switch();
            });
        });
    }
    group.finish();
}

fn deployments(c: &mut Criterion) {
    let mut group = c.benchmark_group("deployment");
    group.sample_size(10);
    for n in [1_000, 10_000, 100_000] {
        let system = System::new(catalogue());
        let conf = deployment(n);
        group.throughput(Throughput::Elements(n as u64));
        group.bench_with_input(BenchmarkId::new("plan", n), &n, |b, _| {
            b.iter(|| plan(&system, &conf, &PlanContext::default()).expect("accepted"));
        });
    }
    group.finish();
}

criterion_group!(benches, switches, deployments);
criterion_main!(benches);
