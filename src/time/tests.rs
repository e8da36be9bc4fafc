use super::*;
use proptest::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const MS: Duration = Duration::from_millis(1);

fn at(ms: u64) -> Time {
    Time(ms * 1_000_000)
}

/// Three periodic threads, a consumer with deadlines and a relay: everything they do, in order.
fn busy_trace(clock: &Clock) -> Vec<String> {
    let trace = Arc::new(Mutex::new(Vec::new()));
    let guard = clock.enter();
    let (tx, rx) = clock.channel::<String>(4);
    let mut joins = Vec::new();
    for (name, period) in [("a", 2), ("b", 3), ("c", 6)] {
        let (clock, tx, trace) = (clock.clone(), tx.clone(), trace.clone());
        joins.push(clock.clone().spawn(name, move || {
            let mut next = clock.now();
            for i in 0..40 {
                next += MS * period;
                clock.sleep_until(next);
                lock(&trace).push(format!("{} {name}{i}", clock.now()));
                let _ = tx.send_deadline(format!("{name}{i}"), clock.now() + MS);
            }
        }));
    }
    drop(tx);
    let (to, from) = (clock.clone(), trace.clone());
    joins.push(clock.spawn("consumer", move || {
        loop {
            match rx.recv_deadline(to.now() + MS) {
                Ok(text) => lock(&from).push(format!("{} got {text}", to.now())),
                Err(RecvError::Timeout) => lock(&from).push(format!("{} nothing", to.now())),
                Err(RecvError::Closed) => break,
            }
        }
    }));
    for join in joins {
        join.join(Time::NEVER).unwrap();
    }
    drop(guard);
    Arc::try_unwrap(trace).unwrap().into_inner().unwrap()
}

#[test]
fn the_same_trace_every_time() {
    let first = busy_trace(&Clock::simulated());
    assert!(first.len() > 240);
    for _ in 0..20 {
        assert_eq!(busy_trace(&Clock::simulated()), first);
    }
}

#[test]
fn pacing_changes_nothing_but_the_pace() {
    assert_eq!(busy_trace(&Clock::simulated_paced(10_000.0)), busy_trace(&Clock::simulated()));
}

#[test]
fn those_due_at_one_moment_run_in_order_of_becoming_participants() {
    let clock = Clock::simulated();
    let trace = Arc::new(Mutex::new(Vec::new()));
    let guard = clock.enter();
    let joins: Vec<Join> = (0..5_u64)
        .map(|i| {
            let (clock, trace) = (clock.clone(), trace.clone());
            clock.clone().spawn("sleeper", move || {
                // They begin to wait for it in another order than their own.
                clock.sleep_until(at(5 - i));
                clock.sleep_until(at(10));
                lock(&trace).push(i);
            })
        })
        .collect();
    for join in joins {
        join.join(Time::NEVER).unwrap();
    }
    drop(guard);
    assert_eq!(*lock(&trace), [0, 1, 2, 3, 4]);
    assert_eq!(clock.now(), at(10));
}

#[test]
fn sleeping_alone_takes_no_hand_over() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let before = clock.hand_overs();
    for i in 1..=1_000 {
        clock.sleep_until(at(i));
    }
    assert_eq!((clock.now(), clock.hand_overs()), (at(1000), before));
}

#[test]
fn deadlines() {
    let clock = Clock::simulated();
    let (tx, rx) = clock.channel::<u8>(1);
    assert_eq!(rx.recv_deadline(at(5)), Err(RecvError::Timeout));
    assert_eq!(clock.now(), at(5));
    tx.try_send(1).unwrap();
    assert_eq!(tx.try_send(2), Err(TrySendError::Full(2)));
    assert_eq!(tx.send_deadline(2, at(7)), Err(SendError::Timeout(2)));
    assert_eq!(clock.now(), at(7));
    assert_eq!(rx.recv_deadline(at(0)), Ok(1), "a value that is there is given out after the deadline too");
    assert_eq!(rx.recv_deadline(at(0)), Err(RecvError::Timeout));
    drop(tx);
    assert_eq!(rx.recv_deadline(at(9)), Err(RecvError::Closed));
    assert_eq!(rx.try_recv(), Err(TryRecvError::Closed));
    let (tx, rx) = clock.channel::<u8>(1);
    drop(rx);
    assert_eq!(tx.try_send(3), Err(TrySendError::Closed(3)));
    assert_eq!(tx.send_deadline(3, at(9)), Err(SendError::Closed(3)));
}

#[test]
fn a_join_has_a_deadline_and_tells_how_the_thread_ended() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let sleeper = clock.clone();
    let late = clock.spawn("late", move || sleeper.sleep_until(at(50)));
    assert_eq!(late.join(at(20)), Err(JoinError::Timeout));
    assert_eq!(clock.now(), at(20));
    let bad = clock.spawn("bad", || std::panic::resume_unwind(Box::new("on purpose")));
    assert_eq!(bad.join(Time::NEVER), Err(JoinError::Panicked("on purpose".into())));
}

#[test]
fn shutdown_releases_those_who_hang_and_nobody_else() {
    for clock in [Clock::simulated(), Clock::real()] {
        let _guard = clock.enter();
        let hanging: Vec<Join> = (0..3)
            .map(|_| {
                let clock = clock.clone();
                clock.clone().spawn("hung", move || clock.hang())
            })
            .collect();
        let (tx, rx) = clock.channel(1);
        let other = clock.spawn("other", move || assert_eq!(rx.recv(), Ok(7)));
        clock.sleep(MS);
        assert!(hanging.iter().all(|join| !join.is_finished()));
        clock.shutdown();
        for join in hanging {
            assert_eq!(join.join(Time::NEVER), Err(JoinError::Released));
        }
        tx.try_send(7).unwrap();
        other.join(Time::NEVER).unwrap();
        let again = clock.clone();
        assert_eq!(clock.spawn("again", move || again.hang()).join(Time::NEVER), Err(JoinError::Released));
    }
}

#[test]
fn time_does_not_move_while_somebody_runs() {
    let clock = Clock::simulated();
    let guard = clock.enter();
    let ticks = Arc::new(AtomicU64::new(0));
    let (ticker, count) = (clock.clone(), ticks.clone());
    let join = clock.spawn("ticker", move || {
        for i in 1..=10 {
            ticker.sleep_until(at(i));
            count.fetch_add(1, Ordering::SeqCst);
        }
    });
    assert_eq!(ticks.load(Ordering::SeqCst), 0, "the token is mine");
    clock.sleep_until(at(4));
    assert_eq!(ticks.load(Ordering::SeqCst), 3, "at 4 ms I come first: I became a participant before");
    drop(guard);
    join.join(Time::NEVER).unwrap();
    assert_eq!(ticks.load(Ordering::SeqCst), 10);
}

#[test]
fn outsiders_wake_participants() {
    // Nobody is ready and no time is waited for: the clock waits for the outside.
    let clock = Clock::simulated();
    let (tx, rx) = clock.channel::<u64>(1_000);
    let (back, answers) = clock.channel::<u64>(1_000);
    let signal = clock.signal();
    let echo = clock.spawn("echo", move || {
        while let Ok(n) = rx.recv() {
            back.try_send(n * 2).unwrap();
        }
    });
    let waiter = signal.clone();
    let waits = clock.spawn("waits", move || assert!(waiter.wait(Time::NEVER)));
    for n in 0..500 {
        tx.try_send(n).unwrap();
        assert_eq!(answers.recv(), Ok(n * 2));
    }
    signal.notify();
    waits.join(Time::NEVER).unwrap();
    drop(tx);
    echo.join(Time::NEVER).unwrap();
    assert_eq!(clock.now(), Time(0));
}

#[test]
fn a_signal_is_cleared_by_the_wait_and_has_a_deadline() {
    for clock in [Clock::simulated(), Clock::real()] {
        let signal = clock.signal();
        signal.notify();
        signal.notify();
        assert!(signal.wait(Time(0)));
        assert!(!signal.wait(clock.now() + MS));
    }
}

#[test]
fn a_queue_that_owns_its_own_sender_can_be_dropped() {
    #[derive(Debug)]
    struct Knot(#[allow(dead_code)] Sender<Knot>);
    let clock = Clock::simulated();
    let (tx, rx) = clock.channel::<Knot>(2);
    tx.try_send(Knot(tx.clone())).unwrap();
    drop(rx);
    drop(tx);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// No wake-up is lost, whoever sends: participants of either clock, and threads the clock does not know.
    #[test]
    fn every_value_arrives_once(
        simulated: bool, bound in 1_usize..4, senders in 1_usize..4, receivers in 1_usize..4, outsiders in 0_usize..3,
        each in 1_u64..200, sleepy: bool,
    ) {
        let clock = if simulated { Clock::simulated() } else { Clock::real() };
        let (tx, rx) = clock.channel::<u64>(bound);
        let sum = Arc::new(AtomicU64::new(0));
        let mut joins = Vec::new();
        for _ in 0..receivers {
            let (clock, rx, sum) = (clock.clone(), rx.clone(), sum.clone());
            joins.push(clock.clone().spawn("receiver", move || loop {
                match rx.recv_deadline(clock.now() + MS) {
                    Ok(n) => { sum.fetch_add(n, Ordering::SeqCst); }
                    Err(RecvError::Timeout) => {}
                    Err(RecvError::Closed) => break,
                }
            }));
        }
        drop(rx);
        for _ in 0..senders {
            let (clock, tx) = (clock.clone(), tx.clone());
            joins.push(clock.clone().spawn("sender", move || for n in 1..=each {
                if sleepy && clock.is_simulated() { clock.sleep(MS / 2); }
                tx.send_deadline(n, Time::NEVER).unwrap();
            }));
        }
        let outside: Vec<_> = (0..outsiders).map(|_| {
            let tx = tx.clone();
            std::thread::spawn(move || for n in 1..=each {
                let mut n = n;
                while let Err(TrySendError::Full(again)) = tx.try_send(n) { n = again; std::thread::yield_now(); }
            })
        }).collect();
        drop(tx);
        for thread in outside { thread.join().unwrap(); }
        for join in joins { join.join(Time::NEVER).unwrap(); }
        let total = (senders + outsiders) as u64 * each * (each + 1) / 2;
        prop_assert_eq!(sum.load(Ordering::SeqCst), total);
    }
}

#[test]
fn idle_waits_do_not_move_time_on_and_end_when_it_goes_on() {
    let clock = Clock::simulated();
    let guard = clock.enter();
    let (_tx, rx) = clock.channel::<()>(1);
    let woken = Arc::new(Mutex::new(Vec::new()));
    let (own, list) = (clock.clone(), woken.clone());
    clock.spawn("idle", move || {
        for _ in 0..3 {
            assert_eq!(rx.recv_or_idle(Time::NEVER, own.now() + MS * 10), Err(RecvError::Timeout));
            lock(&list).push(own.now());
        }
    });
    clock.sleep(MS);
    // Nobody else waits for a time.
    drop(guard);
    assert_eq!((clock.now(), lock(&woken).len()), (at(1), 0));
    let _guard = clock.enter();
    clock.sleep(MS * 24);
    assert_eq!(*lock(&woken), [at(10), at(20)]);
    clock.sleep(MS * 24);
    assert_eq!(*lock(&woken), [at(10), at(20), at(30)]);
}

/// Tasks of several periods, one that its signal wakes and one that sleeps in the middle of a step, beside a thread: everything
/// they do, in order.
fn trace_of_tasks(clock: &Clock, tasks: bool) -> Vec<String> {
    let trace = Arc::new(Mutex::new(Vec::new()));
    let guard = clock.enter();
    let mut joins = Vec::new();
    let spawn = |name: &str, signal: &Signal, mut step: Box<dyn FnMut() -> TaskWait + Send>| {
        if tasks {
            clock.try_spawn_task(name, signal, step).unwrap()
        } else {
            let (clock, signal) = (clock.clone(), signal.clone());
            clock.clone().spawn(name, move || {
                loop {
                    match step() {
                        TaskWait::Wait(deadline) => drop(signal.wait(deadline)),
                        TaskWait::Pause(until) => clock.sleep_until(until),
                        TaskWait::End => return,
                    }
                }
            })
        }
    };
    let woken = clock.signal();
    for (name, period, sleeps) in [("a", 2, 0), ("b", 3, 2), ("c", 6, 7), ("d", 2, 0)] {
        let (own, trace, other, signal) = (clock.clone(), trace.clone(), woken.clone(), clock.signal());
        let (mut i, mut next) = (0, clock.now());
        let step = move || {
            if own.now() < next {
                return TaskWait::Wait(next);
            }
            i += 1;
            lock(&trace).push(format!("{} {name}{i}", own.now()));
            if i % 5 == 0 {
                other.notify();
            }
            own.sleep(MS * sleeps);
            next += MS * period;
            if i == 40 { TaskWait::End } else { TaskWait::Pause(next) }
        };
        joins.push(spawn(name, &signal, Box::new(step)));
    }
    let (own, to) = (clock.clone(), trace.clone());
    let step = move || {
        lock(&to).push(format!("{} woken", own.now()));
        if own.now() >= at(90) { TaskWait::End } else { TaskWait::Wait(own.now() + MS * 25) }
    };
    joins.push(spawn("woken", &woken, Box::new(step)));
    let (own, to) = (clock.clone(), trace.clone());
    joins.push(clock.spawn("thread", move || {
        for i in 1..=30 {
            own.sleep_until(at(i * 4));
            lock(&to).push(format!("{} thread{i}", own.now()));
        }
    }));
    for join in joins {
        join.join(Time::NEVER).unwrap();
    }
    drop(guard);
    std::mem::take(&mut *lock(&trace))
}

#[test]
fn tasks_are_run_in_the_order_of_threads() {
    let threads = trace_of_tasks(&Clock::simulated(), false);
    assert!(threads.len() > 200);
    for _ in 0..20 {
        assert_eq!(trace_of_tasks(&Clock::simulated(), true), threads);
    }
    assert_eq!(trace_of_tasks(&Clock::simulated_paced(10_000.0), true), threads);
}

#[test]
fn a_task_that_waits_in_the_middle_holds_up_nobody() {
    let clock = Clock::simulated();
    let guard = clock.enter();
    let own = clock.clone();
    let hung = clock.try_spawn_task("hung", &clock.signal(), move || own.hang()).unwrap();
    let steps = Arc::new(AtomicU64::new(0));
    let (own, count) = (clock.clone(), steps.clone());
    let step = move || match count.fetch_add(1, Ordering::SeqCst) {
        9 => TaskWait::End,
        _ => TaskWait::Pause(own.now() + MS),
    };
    let other = clock.try_spawn_task("other", &clock.signal(), step).unwrap();
    assert_eq!(other.join(Time::NEVER), Ok(()));
    assert_eq!((steps.load(Ordering::SeqCst), clock.now(), hung.is_finished()), (10, at(9), false));
    let bad = clock.try_spawn_task("bad", &clock.signal(), || std::panic::resume_unwind(Box::new("on purpose")));
    assert_eq!(bad.unwrap().join(Time::NEVER), Err(JoinError::Panicked("on purpose".into())));
    clock.shutdown();
    assert_eq!(hung.join(Time::NEVER), Err(JoinError::Released));
    drop(guard);
}

#[test]
fn tasks_are_woken_from_outside() {
    let clock = Clock::simulated();
    let signal = clock.signal();
    let (back, answers) = clock.channel::<u64>(1_000);
    let mut n = 0;
    let step = move || {
        n += 1;
        back.try_send(n).unwrap();
        if n == 500 { TaskWait::End } else { TaskWait::Wait(Time::NEVER) }
    };
    let task = clock.try_spawn_task("task", &signal, step).unwrap();
    for n in 1..=500 {
        assert_eq!(answers.recv(), Ok(n));
        signal.notify();
    }
    task.join(Time::NEVER).unwrap();
}
