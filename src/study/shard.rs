//! A part of a job of many runs, for execution on several machines.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Part `index` of `of` parts of a job, which contains every `of`-th run, starting with run `index - 1`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Number of the part, from one.
    index: u64,
    /// Number of parts.
    of: u64,
}

/// Invalid part of a job.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "expected two whole numbers i/M with i from 1 to M, such as 3/8 for the third of eight parts"
)]
pub struct ShardError;

impl Shard {
    /// The numbers, from zero and in order, of the runs in this part of `count` runs. If a part was read from a file,
    /// it may be invalid; its runs may then repeat endlessly.
    pub fn runs(self, count: u64) -> impl Iterator<Item = u64> {
        let next = move |run: &u64| run.checked_add(self.of);
        std::iter::successors(self.index.checked_sub(1), next).take_while(move |run| *run < count)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let (index, of) = text.split_once('/').ok_or(ShardError)?;
        let number = |text: &str| text.trim().parse::<u64>().map_err(|_| ShardError);
        let (index, of) = (number(index)?, number(of)?);
        if (1..=of).contains(&index) {
            Ok(Self { index, of })
        } else {
            Err(ShardError)
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_every_run_once() {
        for (of, count) in [(1, 5), (2, 5), (7, 3), (3, 0)] {
            let mut all: Vec<u64> = (1..=of)
                .flat_map(|index| Shard { index, of }.runs(count))
                .collect();
            all.sort_unstable();
            assert_eq!(all, (0..count).collect::<Vec<_>>());
        }
        let last = Shard {
            index: u64::MAX,
            of: u64::MAX,
        };
        assert_eq!(last.runs(9).next(), None);
    }

    #[test]
    fn what_is_no_part_is_refused() {
        assert_eq!("3/8".parse(), Ok(Shard { index: 3, of: 8 }));
        for wrong in ["", "3", "0/8", "9/8", "-1/8", "1/0", "a/b", "1/2/3"] {
            assert_eq!(wrong.parse::<Shard>(), Err(ShardError), "{wrong}");
        }
    }
}
