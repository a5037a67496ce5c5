//! Check of available memory.

use std::hint::black_box;

/// Whether this number of bytes can be allocated now.
///
/// A failed allocation during a calculation aborts the program, and safe code cannot catch it. The memory for a whole
/// step is therefore allocated before the step starts, when an error can still be returned, and then released;
/// untouched memory costs nothing.
pub fn is_there(bytes: usize) -> bool {
    let mut room: Vec<u8> = Vec::new();
    let granted = room.try_reserve_exact(bytes).is_ok();
    // What is never used need never be asked for.
    black_box(room);
    granted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_for_little_and_none_for_more_than_can_be_addressed() {
        assert!(is_there(1 << 10));
        assert!(!is_there(usize::MAX));
    }
}
