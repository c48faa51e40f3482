//! Trials side by side, told one after the other.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc;

/// Calls `job` for 0 to `n` - 1, up to `n_at_once` at a time, and `tell` with each result: on the caller's thread, in
/// order. Once `tell` fails no further job is begun.
///
/// Errors: the first of `tell`.
pub fn in_order<T: Send, E>(
    n: usize,
    n_at_once: usize,
    job: impl Fn(usize) -> T + Sync,
    mut tell: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    if n_at_once <= 1 {
        return (0..n).try_for_each(|index| tell(index, job(index)));
    }
    let (next, is_over) = (AtomicUsize::new(0), AtomicBool::new(false));
    let (sender, results) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..n_at_once.min(n) {
            let (sender, next, is_over, job) = (sender.clone(), &next, &is_over, &job);
            scope.spawn(move || {
                while !is_over.load(Ordering::Relaxed) {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    // The receiver is gone once telling has failed.
                    if index >= n || sender.send((index, job(index))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let (mut waiting, mut n_told) = (BTreeMap::new(), 0);
        for (index, result) in results {
            waiting.insert(index, result);
            while let Some(result) = waiting.remove(&n_told) {
                if let Err(error) = tell(n_told, result) {
                    is_over.store(true, Ordering::Relaxed);
                    return Err(error);
                }
                n_told += 1;
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_order_and_all_of_them() {
        for n_at_once in [1, 2, 7] {
            let mut told = Vec::new();
            let slow_first = |index: usize| {
                std::thread::sleep(std::time::Duration::from_millis(if index.is_multiple_of(3) { 4 } else { 0 }));
                index * index
            };
            in_order(20, n_at_once, slow_first, |index, square| {
                told.push((index, square));
                Ok::<(), ()>(())
            })
            .unwrap();
            assert_eq!(told, (0..20).map(|index| (index, index * index)).collect::<Vec<_>>());
        }
    }

    #[test]
    fn nothing_is_begun_after_telling_failed() {
        for n_at_once in [1, 3] {
            let n_begun = AtomicUsize::new(0);
            let job = |index| {
                n_begun.fetch_add(1, Ordering::Relaxed);
                std::thread::sleep(std::time::Duration::from_millis(1));
                index
            };
            let outcome = in_order(10_000, n_at_once, job, |index, _| if index == 4 { Err("enough") } else { Ok(()) });
            assert_eq!(outcome, Err("enough"));
            assert!(n_begun.load(Ordering::Relaxed) < 1_000, "{n_begun:?}");
        }
    }

    #[test]
    fn no_jobs_are_no_error() {
        assert_eq!(in_order(0, 4, |index| index, |_, _| Err("told")), Ok(()));
    }
}
