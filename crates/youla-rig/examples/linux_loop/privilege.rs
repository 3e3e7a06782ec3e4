//! What a loop asks of the kernel. A refusal costs punctuality, not the loop: it is said and the loop goes on.

use rustix::mm::{MlockAllFlags, mlockall};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// Of SCHED_FIFO, 1 to 99: above the interrupt threads of a kernel with PREEMPT_RT, which have 50.
const PRIORITY: u8 = 80;

/// All pages that the process has and will have stay in memory: no page fault waits for a disk.
pub(crate) fn lock_memory() {
    if let Err(refusal) = mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE) {
        println!(
            "the memory is not locked ({refusal}), pages may be late; cap_ipc_lock (setcap) or memlock in \
             /etc/security/limits.conf grants it"
        );
    }
}

/// SCHED_FIFO for this thread.
pub(crate) fn raise_priority() {
    let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let wanted = PRIORITY.try_into().map(ThreadPriority::Crossplatform);
    let done = wanted.is_ok_and(|wanted| set_thread_priority_and_policy(thread_native_id(), wanted, fifo).is_ok());
    if !done {
        println!(
            "the priority of real time is refused, the loop runs as an ordinary thread; \"setcap cap_sys_nice+ep\" on this program or \
             rtprio in /etc/security/limits.conf grants it"
        );
    }
}
