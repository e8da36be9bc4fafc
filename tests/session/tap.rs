//! The tap between what acts and what observes: bounded, counted, in order, and never waited for by what acts.

use davit::limits;
use davit::model::EventName;
use davit::session::log::LogEntry;
use davit::session::tap::{Full, News, Tap};
use davit::session::{Happening, Hub};
use davit::time::Clock;
use std::sync::mpsc::{Receiver, SyncSender, channel, sync_channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(60);

/// An observer that takes one thing for each permit, and what it took.
struct Reader {
    permits: SyncSender<()>,
    took: Arc<Mutex<Vec<News<u64>>>>,
}

fn tap(bound: usize, clock: &Clock) -> (Tap<u64>, Reader) {
    let took = Arc::new(Mutex::new(Vec::new()));
    let (permits, wait): (SyncSender<()>, Receiver<()>) = sync_channel(1 << 20);
    let taken = took.clone();
    let tap = Tap::new("test", bound, clock, move |news| {
        // Without a permit it stands still; when nobody gives any more it reads freely.
        let _ = wait.recv();
        taken.lock().unwrap().push(news);
    });
    (tap.unwrap(), Reader { permits, took })
}

/// One thing is with the reader, which stands still.
fn stands_still<T: Send + 'static>(tap: &Tap<T>, first: T) {
    tap.put(first);
    while tap.waiting() > 0 {
        std::thread::yield_now();
    }
}

/// What was taken must be 0, 1, 2, …, with holes of the right size; answers the holes.
fn whole(took: &[News<u64>], count: u64) -> Vec<u64> {
    let (mut next, mut holes) = (0, Vec::new());
    for news in took {
        match news {
            News::One(number) => {
                assert_eq!(*number, next, "in order, and holes in their places");
                next += 1;
            }
            News::Missed(missing) => {
                next += missing;
                holes.push(*missing);
            }
        }
    }
    assert_eq!(next, count);
    holes
}

#[test]
fn a_reader_that_stands_still_keeps_nobody_waiting_and_no_more_than_its_bound() {
    let (tap, reader) = tap(limits::TAP, &Clock::real());
    stands_still(&tap, 0);
    for number in 1..1_000_000 {
        tap.put(number);
        assert!(tap.waiting() <= limits::TAP);
    }
    assert_eq!(tap.waiting(), limits::TAP);
    assert_eq!(tap.offer(7), Err(Full));
    let Reader { permits, took } = reader;
    drop(permits);
    assert_eq!(tap.finish(LIMIT), 0);
    let holes = whole(&took.lock().unwrap(), 1_000_000);
    assert_eq!(holes.len(), 1);
    let kept = u64::try_from(limits::TAP).unwrap();
    assert_eq!(holes[0], 1_000_000 - kept - 1, "one was with the reader");
}

#[test]
fn holes_are_told_where_they_are_and_at_most_once_a_second() {
    let clock = Clock::real();
    let (tap, reader) = tap(8, &clock);
    let mut number = 0;
    // A reader that goes on and does not keep up.
    for _ in 0..2_000 {
        for _ in 0..20 {
            tap.put(number);
            number += 1;
        }
        reader.permits.send(()).unwrap();
    }
    let Reader { permits, took } = reader;
    drop(permits);
    assert_eq!(tap.finish(LIMIT), 0);
    let holes = whole(&took.lock().unwrap(), number);
    assert!(!holes.is_empty());
    // The last is told at the end, whenever that is.
    assert!(holes.len() as f64 <= clock.now().as_secs_f64() + 2.0, "{} in {}", holes.len(), clock.now());
}

#[test]
fn a_hole_is_told_also_when_nothing_comes_after_it() {
    let (tap, Reader { permits, took }) = tap(4, &Clock::real());
    (0..100).for_each(|number| tap.put(number));
    drop(permits);
    // Not its end: what waits is taken, and the hole with it.
    assert_eq!(tap.flush(LIMIT), 0);
    assert_eq!(whole(&took.lock().unwrap(), 100).len(), 1);
}

#[test]
fn what_a_command_says_of_itself_has_room() {
    let (tap, Reader { permits, took }) = tap(4, &Clock::real());
    (0..100).for_each(|number| tap.put(number));
    (100..110).for_each(|number| tap.put_own(number));
    (110..10_000).for_each(|number| tap.put_own(number));
    assert!(tap.waiting() <= 4 + limits::TAP_OWN + 1, "bounded too");
    drop(permits);
    assert_eq!(tap.finish(LIMIT), 0);
    let took = took.lock().unwrap();
    whole(&took, 10_000);
    assert!((100..110).all(|number| took.contains(&News::One(number))));
}

#[test]
fn in_simulated_time_nothing_is_lost() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let (tap, Reader { permits, took }) = tap(16, &clock);
    let reader = std::thread::spawn(move || (0..20_000).for_each(|_| permits.send(()).unwrap()));
    for number in 0..20_000 {
        tap.put(number);
        tap.keep_pace();
    }
    assert_eq!(tap.finish(LIMIT), 0);
    assert!(whole(&took.lock().unwrap(), 20_000).is_empty());
    reader.join().unwrap();
}

#[test]
fn the_end_waits_only_for_a_reader_that_reads() {
    for clock in [Clock::real(), Clock::simulated()] {
        let (tap, reader) = tap(100, &clock);
        stands_still(&tap, 0);
        (1..10).for_each(|number| tap.put(number));
        assert_eq!(tap.finish(Duration::from_millis(20)), 10, "how many were not read");
        tap.put(10);
        assert!(tap.waiting() <= 10, "nothing comes after the end");
        drop(reader);
    }
}

#[test]
fn an_observer_that_panics_keeps_nobody_waiting() {
    let tap = Tap::new("test", 4, &Clock::simulated(), |_: News<u64>| panic!("a panic of the test's")).unwrap();
    (0..100).for_each(|number| {
        tap.put(number);
        tap.keep_pace();
    });
    assert_eq!(tap.finish(LIMIT), 0);
}

/// Takes nothing until it is told to.
struct Deaf(Arc<LogEntry>);

impl From<Arc<LogEntry>> for Deaf {
    fn from(entry: Arc<LogEntry>) -> Self {
        Self(entry)
    }
}

#[test]
fn a_deaf_observer_does_not_stop_the_hub_and_its_memory_is_bounded() {
    let clock = Clock::real();
    let hub = Hub::new(&clock, [], [EventName::new("e").unwrap()]);
    let (go, wait) = channel::<()>();
    let (heard, hears) = channel();
    let tap = Tap::new("deaf", limits::TAP, &clock, move |news: News<Deaf>| {
        let _ = wait.recv();
        if let News::One(Deaf(entry)) = news {
            let _ = heard.send(entry);
        }
    });
    let tap = tap.unwrap();
    stands_still(&tap, Deaf(Arc::new(LogEntry { at: 0.0, what: Happening::Emitted { event: "first".to_owned() } })));
    hub.attach(Arc::new(tap.clone()));
    for _ in 0..200_000 {
        hub.report(Happening::Emitted { event: "e".to_owned() });
    }
    assert_eq!(tap.waiting(), limits::TAP);
    assert_eq!(hub.log(usize::MAX).len(), limits::LOG_REPORTS);
    drop(go);
    assert_eq!(tap.finish(LIMIT), 0);
    assert_eq!(hears.try_iter().count(), limits::TAP + 1);
}

#[test]
fn a_wait_runs_out_also_while_much_happens() {
    let hub = Arc::new(Hub::new(&Clock::real(), [], []));
    let (over, ended) = channel();
    let waits = hub.clone();
    std::thread::spawn(move || {
        let found: Option<()> = waits.wait_outside(Duration::from_millis(300), |_| None);
        let _ = over.send(found);
    });
    // It is woken all the time.
    let clock = Clock::real();
    let found = loop {
        hub.wake();
        if let Ok(found) = ended.try_recv() {
            break found;
        }
        assert!(clock.now().as_secs_f64() < LIMIT.as_secs_f64(), "it never runs out");
    };
    assert_eq!(found, None);
}

#[test]
fn in_simulated_time_whoever_notes_something_waits_for_a_slow_observer() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let hub = Hub::new(&clock, [], []);
    let heard = Arc::new(Mutex::new(Vec::new()));
    let hears = heard.clone();
    let tap = Tap::new("slow", 16, &clock, move |news: News<Deaf>| {
        std::thread::yield_now();
        hears.lock().unwrap().push(match news {
            News::One(Deaf(entry)) => serde_json::to_value(&entry.what).unwrap()["event"].clone(),
            News::Missed(missing) => panic!("{missing} are missing"),
        });
    });
    let tap = tap.unwrap();
    hub.attach(Arc::new(tap.clone()));
    for number in 0..5_000 {
        hub.note(Happening::Emitted { event: format!("e_{number}") });
    }
    assert_eq!(tap.finish(LIMIT), 0);
    let heard = heard.lock().unwrap();
    assert_eq!(heard.len(), 5_000);
    assert!(heard.iter().enumerate().all(|(number, event)| *event == format!("e_{number}")));
}
