//! What travels through the ports.

davit::record! {
    /// What is done to the arm.
    #[derive(Copy, Default)]
    pub struct Command {
        /// By the motors: rail (N), shoulder, elbow (N m), quill (N), wrist (N m).
        pub effort: [f64; 5],
        /// Their windings are shorted, and they give nothing.
        pub shorted: bool,
        /// The quill's brake is closed.
        pub brake: bool,
    }

    /// Where the axes are: rail (m), shoulder, elbow (rad), quill (m), wrist (rad).
    #[derive(Copy, Default)]
    pub struct Axes {
        /// Where.
        pub pos: [f64; 5],
        /// How they move.
        pub vel: [f64; 5],
    }

    /// A tool: x along the rail, y away from it, z up (m), and its angle about z (rad).
    #[derive(Copy, Default)]
    pub struct Tool {
        /// Where.
        pub p: [f64; 4],
        /// How it moves.
        pub v: [f64; 4],
    }

    /// What one end tells the other one.
    #[derive(Copy, Default)]
    pub struct Told {
        /// Where its tool was.
        pub p: [f64; 4],
        /// How it moved.
        pub v: [f64; 4],
        /// When, ns of the clock.
        pub stamp: i64,
        /// It is near the other one.
        pub aligned: bool,
        /// It wants to be coupled.
        pub coupled: bool,
    }
}
