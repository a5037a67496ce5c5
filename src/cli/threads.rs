//! On how many threads a command works.

use rayon::{ThreadPoolBuildError, ThreadPoolBuilder};

/// Does `work` on one thread a processor or as many as RAYON_NUM_THREADS says, and on this one alone
/// where the system does not let them be started.
pub fn with_threads<T: Send>(work: impl FnOnce() -> T + Send) -> Result<T, ThreadPoolBuildError> {
    match ThreadPoolBuilder::new().build() {
        Ok(pool) => Ok(pool.install(work)),
        Err(_) => {
            eprintln!("note: the system does not let threads be started; working on one alone");
            let alone = ThreadPoolBuilder::new().num_threads(1).use_current_thread();
            let _pool = alone.build()?;
            Ok(work())
        }
    }
}
