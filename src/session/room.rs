//! How many clients there is room for.

use crate::limits;

/// For how many connections the descriptors of the process suffice beside those that are kept, and what the deployment itself opens now and then.
pub(super) fn for_connections(kept: usize) -> usize {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: a limit is written to a place for one.
    if unsafe { libc::getrlimit(libc::RLIMIT_NOFILE, &raw mut limit) } != 0 {
        return usize::MAX;
    }
    // Where nobody tells what is open there is no reason to be sparing.
    let Ok(open) = std::fs::read_dir("/proc/self/fd") else { return usize::MAX };
    fitting(usize::try_from(limit.rlim_cur).unwrap_or(usize::MAX), open.count(), kept)
}

fn fitting(limit: usize, open: usize, kept: usize) -> usize {
    limit.saturating_sub(open).saturating_sub(kept + limits::SOCKET_SPARE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kept_places_and_what_is_spare_are_left() {
        assert_eq!(fitting(1024, 14, 4), 1024 - 14 - 4 - limits::SOCKET_SPARE);
        assert_eq!(fitting(20, 14, 4), 0);
        assert_eq!(fitting(usize::MAX, 14, 4), usize::MAX - 14 - 4 - limits::SOCKET_SPARE);
    }
}
