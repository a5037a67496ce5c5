//! Number of threads used by a command.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use rayon::{ThreadPoolBuildError, ThreadPoolBuilder};

/// Runs `work` on one thread per processor or on the number of threads given in RAYON_NUM_THREADS; if the system
/// refuses further threads, runs it on the current thread.
pub fn with_threads<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, ThreadPoolBuildError> {
    match ThreadPoolBuilder::new().build() {
        Ok(pool) if pool.current_num_threads() > 1 => return Ok(pool.install(work)),
        // The first thread serves as well, and better if address space is limited: glibc reserves 64 MB for every other
        // thread and, if that fails, tries again at each allocation.
        Ok(_) => {}
        Err(_) => {
            tell!(
                "note: the operating system does not allow more threads, so turncal uses only one"
            );
        }
    }
    let alone = ThreadPoolBuilder::new().num_threads(1).use_current_thread();
    let _pool = alone.build()?;
    Ok(work())
}

/// Computes `count` work items. Each thread holds only one item in memory at a time. The results are returned in the
/// order of the items.
pub fn piece_by_piece<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(count));
    let threads = rayon::current_num_threads();
    let workers = threads.min(count).max(1);
    let worker = || {
        loop {
            let piece = next.fetch_add(1, Ordering::Relaxed);
            if piece >= count {
                break;
            }
            let result = work(piece);
            let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
            results.push((piece, result));
        }
    };
    // If there are fewer pieces than threads, the other threads work inside the pieces.
    let own_pool = || {
        let pool = ThreadPoolBuilder::new().num_threads((threads / workers).max(1));
        match pool.build() {
            Ok(pool) => pool.install(worker),
            Err(_) => worker(),
        }
    };
    thread::scope(|scope| {
        for _ in 1..workers {
            // If no more threads can be started, the existing ones do all the work.
            let _ = thread::Builder::new().spawn_scoped(scope, own_pool);
        }
        own_pool();
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(piece, _)| *piece);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_is_done_once_and_in_order_and_no_more_at_once_than_there_are_threads() {
        let pool = ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let (now, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let work = |piece| {
            let begun = now.fetch_add(1, Ordering::SeqCst) + 1;
            most.fetch_max(begun, Ordering::SeqCst);
            // A piece that is itself parallel must not take up another.
            rayon::join(thread::yield_now, thread::yield_now);
            now.fetch_sub(1, Ordering::SeqCst);
            piece * 2
        };
        let done = pool.install(|| piece_by_piece(50, work));
        assert_eq!(done, (0..50).map(|piece| piece * 2).collect::<Vec<_>>());
        assert!(most.into_inner() <= 3);
        assert!(piece_by_piece(0, |piece| piece).is_empty());
    }
}
