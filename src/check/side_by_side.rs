//! Files that have nothing to do with each other are followed side by side, on as many cores as there are.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::{Builder, available_parallelism, scope};

/// What `of` says of each, in their order and as if one had come after the other. Who asks does its part, so that all is done though the
/// operating system has no thread left.
pub fn each<T: Sync, R: Send>(items: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    on_threads(available_parallelism().map_or(1, usize::from), items, of)
}

fn on_threads<T: Sync, R: Send>(threads: usize, items: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut said = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else { return said };
            said.push((at, of(item)));
        }
    };
    let mut all = scope(|scope| {
        let thread = |_| Builder::new().name("davit-check".to_owned()).spawn_scoped(scope, work).ok();
        let others: Vec<_> = (1..threads.min(items.len())).map_while(thread).collect();
        let mut all = work();
        for other in others {
            all.extend(other.join().unwrap_or_else(|panicked| resume_unwind(panicked)));
        }
        all
    });
    all.sort_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, said)| said).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Mutex, mpsc};
    use std::time::Duration;

    #[test]
    fn what_is_said_comes_in_the_order_of_what_was_asked() {
        // Whoever has the first one waits until the other has done the second.
        let (done, waits) = mpsc::channel();
        let waits = Mutex::new(waits);
        let of = |number: &u32| {
            match number {
                0 => waits.lock().unwrap().recv_timeout(Duration::from_secs(60)).unwrap(),
                1 => done.send(()).unwrap(),
                _ => {}
            }
            number * 2
        };
        let numbers: Vec<u32> = (0..50).collect();
        assert_eq!(on_threads(2, &numbers, of), numbers.iter().map(|number| number * 2).collect::<Vec<_>>());
        assert!(on_threads(2, &[] as &[u32], |number| *number).is_empty());
    }
}
