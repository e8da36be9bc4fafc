//! The embedded platform, to be tested.

use davit::model::{EventName, Transition, Tunable};
use davit::platform::conformance::{self, Bed, BedTrouble, Times, UnderTest};
use davit::platform::embedded::EmbeddedPlatform;
use davit::record;
use davit::runtime::{
    Builder, Component, ComponentFactory, Context, EventOut, Failure, HookResult, In, Libraries, Library,
    OperationAnswer, Out, Prop, Ticket,
};
use davit::time::{Clock, Time};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub struct EmbeddedBed;

/// What tests ask of components that they cannot reach: by the clock, of which every test has its own.
struct Wish {
    clock: Clock,
    trouble: Vec<(&'static str, BedTrouble)>,
    raise: Vec<(String, String)>,
}

static WISHES: Mutex<Vec<Wish>> = Mutex::new(Vec::new());

fn with_wish<R>(clock: &Clock, f: impl FnOnce(&mut Wish) -> R) -> Option<R> {
    WISHES.lock().unwrap().iter_mut().find(|wish| wish.clock.is(clock)).map(f)
}

record! {
    /// Where something is.
    #[derive(Default)]
    struct Place {
        x: f64,
        y: f64,
    }
}

#[allow(dead_code, clippy::type_complexity)]
struct Plant {
    inputs: (In<f64>, In<f64>, In<f64>, In<[f64; 3]>, In<i64>, In<f64>, In<EventName>),
    outputs: (Out<f64>, Out<f64>, Out<[f64; 3]>),
    said: EventOut,
    gain: Prop<f64>,
    gains: Prop<[f64; 3]>,
    mode: Prop<i64>,
    device: Prop<String>,
    pose: Prop<Place>,
}

impl Component for Plant {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Has a member of every kind.");
        b.no_effect().operation("nothing", |_, _, (): ()| OperationAnswer::Done(()));
        b.no_effect().operation("scale", |_, _, (a, b): (f64, i64)| OperationAnswer::Done(a * b as f64));
        Self {
            inputs: (
                b.unit("N").input("u"),
                b.input("u_plain"),
                b.unit("m").input("u_m"),
                b.input("v"),
                b.input("n"),
                b.unit("N").buffered().input("q"),
                b.event_input("heard"),
            ),
            outputs: (b.unit("N").output("y"), b.unit("N").output("y2"), b.output("w")),
            said: b.event_output("said"),
            gain: b.range(0.0..=10.0).property("gain", 1.0),
            gains: b.range(0.0..=10.0).property("gains", [1.0; 3]),
            mode: b.tunable(Tunable::Stopped).required_property("mode", 0),
            device: b.tunable(Tunable::Unconfigured).property("device", "none".to_owned()),
            pose: b.range(-1.0..=1.0).property("pose", Place::default()),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let name = cx.name().to_string();
        let asked = with_wish(cx.clock(), |wish| {
            let at = wish.raise.iter().position(|(component, _)| *component == name)?;
            Some(wish.raise.remove(at).1)
        });
        if let Some(event) = asked.flatten() {
            self.said.raise(EventName::new(&event).unwrap());
        }
    }
}

struct Misbehaving {
    /// None while it is made: so it has none when it is dropped at once.
    clock: Option<Clock>,
    /// It is updated.
    runs: bool,
    /// When what is to be answered.
    task: Option<(Time, Ticket)>,
}

fn trouble_of(clock: &Clock, what: &str) -> Option<BedTrouble> {
    with_wish(clock, |w| w.trouble.iter().find(|(h, _)| *h == what).map(|(_, t)| *t)).flatten()
}

fn misbehave(clock: &Clock, hook: &str) -> HookResult {
    match trouble_of(clock, hook) {
        None | Some(BedTrouble::Long | BedTrouble::Deaf) => Ok(()),
        Some(BedTrouble::Fail) => Err(Failure::from("on purpose")),
        Some(BedTrouble::Panic) => panic!("on purpose"),
        Some(BedTrouble::Hang(None)) => clock.hang(),
        Some(BedTrouble::Hang(Some(time))) => {
            clock.sleep(time);
            Ok(())
        }
    }
}

impl Component for Misbehaving {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Does in its hooks what the test asks for.");
        b.on_configure(|_, cx| misbehave(cx.clock(), Transition::Configure.as_str()));
        b.on_start(|c, cx| {
            c.runs = true;
            misbehave(cx.clock(), Transition::Start.as_str())
        });
        b.on_stop(|c, cx| {
            c.runs = false;
            misbehave(cx.clock(), Transition::Stop.as_str())
        });
        b.on_cleanup(|_, cx| misbehave(cx.clock(), Transition::Cleanup.as_str()));
        b.no_effect().operation("work", Self::work);
        b.no_effect().operation("nothing", |_, _, (): ()| OperationAnswer::Done(()));
        b.no_effect().operation("echo", |_, _, (_,): (i64,)| OperationAnswer::Done(()));
        b.no_effect().caller_operation("brake", |(): ()| OperationAnswer::Done(()));
        Self { clock: None, runs: false, task: None }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some((end, ticket)) = self.task.take() else { return };
        if cx.now() >= end {
            ticket.done(());
        } else if ticket.is_cancelled() && trouble_of(cx.clock(), "work") == Some(BedTrouble::Long) {
            ticket.failed("it was given up");
        } else {
            self.task = Some((end, ticket));
        }
    }
}

impl Misbehaving {
    /// Takes many updates while it is updated; on a worker it takes its time there.
    fn work(&mut self, cx: &mut Context, (): ()) -> OperationAnswer {
        let trouble = trouble_of(cx.clock(), "work");
        let end = cx.clock().now() + Times::default().work;
        match trouble {
            Some(BedTrouble::Long | BedTrouble::Deaf) => {}
            Some(BedTrouble::Fail) => return OperationAnswer::failed("on purpose"),
            _ => return OperationAnswer::Done(()),
        }
        if self.runs {
            self.task = Some((end, cx.ticket()));
            return OperationAnswer::Pending;
        }
        while cx.clock().now() < end {
            if trouble == Some(BedTrouble::Long) && cx.is_cancelled() {
                return OperationAnswer::failed("it was given up");
            }
            cx.clock().sleep(Duration::from_millis(1));
        }
        OperationAnswer::Done(())
    }
}

impl Drop for Misbehaving {
    fn drop(&mut self) {
        if let Some(clock) = &self.clock {
            let _ = misbehave(clock, "destroy");
        }
    }
}

pub fn libraries(clock: &Clock) -> Libraries {
    let clock = clock.clone();
    let misbehaving = ComponentFactory::made_by("Misbehaving", move |b| {
        let mut made = Misbehaving::new(b);
        let _ = misbehave(&clock, "create");
        made.clock = Some(clock.clone());
        made
    });
    Libraries::new().with(Library::new("bed").with::<Plant>("Plant").with_kind(misbehaving))
}

/// At the end of a test: those who hang are released, so that no thread outlives it.
struct Release(Clock);

impl Drop for Release {
    fn drop(&mut self) {
        self.0.shutdown();
        WISHES.lock().unwrap().retain(|wish| !wish.clock.is(&self.0));
    }
}

impl Bed for EmbeddedBed {
    fn make(&self, trouble: &[(&'static str, BedTrouble)]) -> UnderTest {
        let clock = Clock::simulated();
        let guard = clock.enter();
        // A type is made once to be described, before anything is asked of it.
        let libraries = libraries(&clock);
        WISHES.lock().unwrap().push(Wish { clock: clock.clone(), trouble: trouble.to_vec(), raise: Vec::new() });
        let platform = EmbeddedPlatform::new(&clock, &libraries, &BTreeMap::new());
        let asked = clock.clone();
        UnderTest {
            platform: Arc::new(platform),
            clock: clock.clone(),
            raise: Box::new(move |component, event| {
                with_wish(&asked, |wish| wish.raise.push((component.to_owned(), event.to_owned())));
            }),
            keep: vec![Box::new(Release(clock)), Box::new(guard)],
        }
    }
}

/// The suite's types are the same on every platform.
#[test]
fn the_types_are_those_of_the_suite() {
    let here = libraries(&Clock::simulated()).catalogue();
    for ty in conformance::types() {
        assert_eq!(**here.get(ty.name).unwrap(), ty);
    }
}
