//! How many clients there is room for.

use crate::limits;

/// Descriptors that are needed beside those that are open: for one connection, those that are kept, and what is spare.
pub(super) const LEAST: usize = 1 + limits::SOCKET_KEPT + limits::SOCKET_SPARE;

/// The descriptors of the process.
#[derive(Debug, Clone, Copy)]
pub(super) struct DescriptorRoom {
    /// That are open.
    pub open: usize,
    /// That may be.
    pub limit: usize,
}

impl DescriptorRoom {
    /// As it is now; none: nobody tells, and there is no reason to be sparing.
    pub fn now() -> Option<Self> {
        let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
        // SAFETY: a limit is written to a place for one.
        if unsafe { libc::getrlimit(libc::RLIMIT_NOFILE, &raw mut limit) } != 0 {
            return None;
        }
        let open = std::fs::read_dir("/proc/self/fd").ok()?.count();
        Some(Self { open, limit: usize::try_from(limit.rlim_cur).unwrap_or(usize::MAX) })
    }

    /// For how many connections they suffice beside those that are kept, and what the deployment itself opens now and then.
    pub fn connections(self, kept: usize) -> usize {
        self.limit.saturating_sub(self.open).saturating_sub(kept + limits::SOCKET_SPARE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kept_places_and_what_is_spare_are_left() {
        let fitting = |limit| DescriptorRoom { open: 14, limit }.connections(4);
        assert_eq!(fitting(1024), 1024 - 14 - 4 - limits::SOCKET_SPARE);
        assert_eq!(fitting(20), 0);
        assert_eq!((fitting(14 + LEAST), fitting(13 + LEAST)), (1, 0));
        assert_eq!(fitting(usize::MAX), usize::MAX - 14 - 4 - limits::SOCKET_SPARE);
    }
}
