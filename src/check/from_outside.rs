//! What is known of events from outside, wherever they come.

/// Who may still raise an event from outside while the deployment is being stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Raises {
    /// Nobody.
    Nobody,
    /// A component that fails, or one or a monitor that reports it where it has reason to.
    Sometimes,
    /// A component, if one does: the types of this platform do not say what they raise.
    Perhaps,
    /// Somebody from outside; or it comes by itself.
    Somebody,
}

/// What is known of an event from outside wherever it comes: it is asked for again and again.
#[derive(Debug, Clone, Copy)]
pub struct FromOutside {
    /// Coordinators tell it each other.
    pub told_between: bool,
    /// Who may raise it, or one that is followed as it, while the deployment is being stopped.
    pub raises: Raises,
}
