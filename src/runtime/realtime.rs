//! What an activity's thread asks of the operating system: a priority, a CPU. Not getting it is said, and is no error: on a
//! desktop nobody may have it.

use thread_priority::unix::{set_thread_priority_and_policy, thread_native_id};
use thread_priority::{RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy};

/// Gives the calling thread a real-time priority (first in, first out; 1 to 99; 0: none asked for) and binds it to a CPU.
/// What was refused, in words.
pub(crate) fn apply(priority: u8, cpu: Option<u32>) -> Option<String> {
    let mut refused = Vec::new();
    if priority > 0
        && let Err(error) = prioritise(priority)
    {
        refused.push(format!("no real-time priority {priority}: {error}"));
    }
    if let Some(cpu) = cpu
        && let Err(error) = bind(cpu)
    {
        refused.push(format!("not bound to CPU {cpu}: {error}"));
    }
    (!refused.is_empty()).then(|| refused.join("; "))
}

fn prioritise(priority: u8) -> Result<(), String> {
    let level = ThreadPriorityValue::try_from(priority.min(99)).map_err(|error| format!("{error:?}"))?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(level), policy)
        .map_err(|error| format!("{error:?}"))
}

#[cfg(target_os = "linux")]
fn bind(cpu: u32) -> Result<(), String> {
    let cpu = usize::try_from(cpu).ok().filter(|cpu| *cpu < 8 * size_of::<libc::cpu_set_t>());
    let cpu = cpu.ok_or("there is no such CPU")?;
    // SAFETY: a `cpu_set_t` is an array of words, for which zero is a value; `CPU_SET` writes inside it, as `cpu` is less
    // than its number of bits; the call reads it and keeps nothing.
    let result = unsafe {
        let mut set: libc::cpu_set_t = std::mem::zeroed();
        libc::CPU_SET(cpu, &mut set);
        libc::sched_setaffinity(0, size_of::<libc::cpu_set_t>(), &raw const set)
    };
    if result == 0 { Ok(()) } else { Err(std::io::Error::last_os_error().to_string()) }
}

#[cfg(not(target_os = "linux"))]
fn bind(_: u32) -> Result<(), String> {
    Err("not on this operating system".to_owned())
}
