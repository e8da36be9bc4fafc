//! Ctrl-C, and being asked to end (SIGTERM, SIGHUP, SIGQUIT, SIGXCPU, SIGPWR).

use super::exit::Exit;
use super::{last_words, output};
use crate::limits;
use crate::time::{Clock, Time};
use libc::SIGPWR;
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGXCPU};
use signal_hook::iterator::{Handle, Signals};
use std::thread::JoinHandle;

/// Signals that ask a program for something that it offers (turn the log over, a timer, a profile): none of them is offered here, and
/// what is not caught would end the process with all that it holds.
const MEANT_FOR_OTHERS: [i32; 6] =
    [libc::SIGUSR1, libc::SIGUSR2, libc::SIGALRM, libc::SIGVTALRM, libc::SIGPROF, libc::SIGIO];

/// Watches for signals until dropped.
pub struct SignalWatch {
    handle: Handle,
    thread: Option<JoinHandle<()>>,
}

/// What is said to Ctrl-Z.
const STAYS_AWAKE: &str = "note: Ctrl-Z does not stop a deployment: nobody would look after the robot; `--detach` runs it in the background\n";

/// What a signal asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asks {
    Nothing,
    Stop,
    Force,
    Leave,
}

/// The signals so far.
#[derive(Debug, Default)]
struct SignalSeen {
    count: u8,
    /// When one counted last, and when any came.
    counted: Option<Time>,
    last: Option<Time>,
}

impl SignalSeen {
    /// Each signal asks for more. But one cause may bring several: a shell tells its jobs that the terminal is gone, and then the
    /// kernel does; `timeout`, or who passes Ctrl-C on, tells a process and its group; those that come together come in any
    /// order; a key that is held down repeats. So a terminal that is gone, or a time limit, asks for no more than the first one
    /// has; what follows the first within [`limits::SIGNAL_REPEATS`] is the same; and only after a pause of
    /// [`limits::SIGNAL_HELD`] one asks for the end at once.
    ///
    /// `held`: stopping stands still until somebody asks for force. Then one more asks for that, and for no end at once; the first one
    /// too, where something else had asked for the end.
    fn asks(&mut self, signal: i32, now: Time, held: bool) -> Asks {
        let gone = matches!(signal, SIGHUP | SIGXCPU | SIGPWR);
        let within = |of: Option<Time>, limit| of.is_some_and(|of| now.since(of) < limit);
        let same = match self.count {
            0 => false,
            _ if gone => true,
            1 => within(self.counted, limits::SIGNAL_REPEATS),
            _ => within(self.last, limits::SIGNAL_HELD),
        };
        self.last = Some(now);
        if same {
            return Asks::Nothing;
        }
        self.counted = Some(now);
        self.count = if held && !gone { 2 } else { (self.count + 1).min(3) };
        match self.count {
            1 => Asks::Stop,
            2 => Asks::Force,
            _ => Asks::Leave,
        }
    }
}

impl SignalWatch {
    /// At the first signal calls `stop(false)`, at the second `stop(true)`: by force; and again at each that comes while it is `held`
    /// until somebody asks for that. The third is for when even that does not come to an end: it calls `leave` and ends the process with [`Exit::Forced`]; nothing more is asked of the components, and
    /// what the process holds goes with it. Where it `goes_on` without a terminal the end of that (SIGHUP) is no signal. What whoever has
    /// started the process had it ignore (`nohup`, a shell without a terminal for what runs beside it) stays ignored.
    ///
    /// # Errors
    /// When the operating system does not let signals be watched.
    pub fn start(
        goes_on: impl Fn() -> bool + Send + 'static,
        stop: impl Fn(bool) + Send + 'static,
        held: impl Fn() -> bool + Send + 'static,
        leave: impl FnOnce() + Send + 'static,
    ) -> std::io::Result<Self> {
        [libc::SIGTTOU, libc::SIGTTIN].into_iter().chain(MEANT_FOR_OTHERS).for_each(ignore);
        warn_before_the_time_is_over();
        let asking =
            [SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU, SIGPWR].into_iter().filter(|signal| !is_ignored(*signal));
        let mut signals = Signals::new(asking.chain([SIGTSTP]))?;
        let handle = signals.handle();
        let thread = std::thread::Builder::new().name("davit-signals".to_owned()).spawn(move || {
            let (clock, mut seen) = (Clock::real(), SignalSeen::default());
            for signal in signals.forever() {
                if signal == SIGTSTP {
                    last_words::say(|| output::error(STAYS_AWAKE));
                    continue;
                }
                if signal == SIGHUP && goes_on() {
                    continue;
                }
                match seen.asks(signal, clock.now(), held()) {
                    Asks::Nothing => {}
                    Asks::Stop => stop(false),
                    Asks::Force => stop(true),
                    Asks::Leave => {
                        leave();
                        std::process::exit(i32::from(Exit::Forced.code()));
                    }
                }
            }
        })?;
        Ok(Self { handle, thread: Some(thread) })
    }

    /// Goes on until the process ends, whatever it still has to say.
    pub fn until_the_end(self) {
        std::mem::forget(self);
    }
}

/// From now on who is asked to end gives the terminal back as it is now, and ends: a line editor has it take single keys, which
/// would be left so.
///
/// # Errors
/// When the operating system does not let signals be watched, or has no thread left.
pub fn give_terminal_back() -> std::io::Result<()> {
    let mut before = std::mem::MaybeUninit::<libc::termios>::uninit();
    // SAFETY: `before` is as large as what is written to it, and it is read only when the call says that it was.
    let before = match unsafe { libc::tcgetattr(libc::STDIN_FILENO, before.as_mut_ptr()) } {
        0 => unsafe { before.assume_init() },
        _ => return Ok(()),
    };
    let mut signals = Signals::new([SIGTERM, SIGHUP, SIGQUIT])?;
    std::thread::Builder::new().name("davit-signals".to_owned()).spawn(move || {
        for signal in signals.forever() {
            // SAFETY: it is what the terminal itself has said. That a terminal is gone hurts nobody.
            unsafe { libc::tcsetattr(libc::STDIN_FILENO, libc::TCSANOW, &raw const before) };
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    })?;
    Ok(())
}

/// A file that may get no larger (`ulimit -f`) is a disk that is full: no end of the process.
pub fn ignore_large_files() {
    ignore(libc::SIGXFSZ);
}

/// A terminal that takes no output from the background (`stty tostop`), or is asked for input there, would stop the process,
/// coordinator and all.
fn ignore(signal: i32) {
    // SAFETY: ignoring a signal runs no code of ours, and `signal` is given a number and a disposition that exist.
    unsafe { libc::signal(signal, libc::SIG_IGN) };
}

/// What is said to Ctrl-C before anything has begun, on a terminal over the line that tells how far it is.
const NOTHING_BEGAN: &str = "interrupted while it was being checked: nothing was begun\n";
const OVER_THE_LINE: &str = "\r\x1b[2K";

/// While it is there, Ctrl-C says that nothing was begun, and ends the process as it would by itself.
pub struct NothingBegan {
    here: bool,
}

impl NothingBegan {
    /// From now on; where Ctrl-C is ignored, or somebody watches for it, that stays.
    pub fn watch() -> Self {
        let says: extern "C" fn(libc::c_int) = says_that_nothing_began;
        // SAFETY: the handler calls nothing but what a handler may call, and what was there is put back.
        let before = unsafe { libc::signal(SIGINT, says as libc::sighandler_t) };
        let here = before == libc::SIG_DFL;
        if !here {
            // SAFETY: it is what was there.
            unsafe { libc::signal(SIGINT, before) };
        }
        Self { here }
    }
}

impl Drop for NothingBegan {
    fn drop(&mut self) {
        if self.here {
            // SAFETY: it is what was there.
            unsafe { libc::signal(SIGINT, libc::SIG_DFL) };
        }
    }
}

/// Writes, and lets the signal do what it does by itself.
extern "C" fn says_that_nothing_began(signal: libc::c_int) {
    let say = |text: &str| {
        // SAFETY: `text` is as long as it says; a handler may write.
        unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
    };
    // SAFETY: a handler may ask for that, change what the signal does, and raise it.
    unsafe {
        if libc::isatty(libc::STDERR_FILENO) == 1 {
            say(OVER_THE_LINE);
        }
        say(NOTHING_BEGAN);
        libc::signal(signal, libc::SIG_DFL);
        libc::raise(signal);
    }
}

/// Whether whoever has started this process had it ignore a signal.
fn is_ignored(signal: i32) -> bool {
    let mut action = std::mem::MaybeUninit::<libc::sigaction>::zeroed();
    // SAFETY: nothing is set; `action` is as large as what is written to it, and a zeroed one is one.
    let action = unsafe {
        libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr());
        action.assume_init()
    };
    action.sa_sigaction == libc::SIG_IGN
}

/// `ulimit -t` sets both limits of processor time, and at the second one the kernel kills. So the first one, which can be led
/// down at, is made to come sooner.
fn warn_before_the_time_is_over() {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: a limit is written to a place for one, and one that is lower is set.
    unsafe {
        if libc::getrlimit(libc::RLIMIT_CPU, &raw mut limit) == 0 && limit.rlim_max != libc::RLIM_INFINITY {
            let early = limit.rlim_max.saturating_sub((limit.rlim_max / 2).min(limits::TIME_TO_LEAD_DOWN.as_secs()));
            if limit.rlim_cur > early {
                limit.rlim_cur = early.max(1);
                libc::setrlimit(libc::RLIMIT_CPU, &raw const limit);
            }
        }
    }
}

/// What is told at the first signal, and at the second.
pub fn told(force: bool) -> &'static str {
    match force {
        false => "stopping; Ctrl-C again takes it down by force",
        true => "by force; Ctrl-C again ends at once and asks the components nothing more",
    }
}

impl Drop for SignalWatch {
    fn drop(&mut self) {
        self.handle.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests;
