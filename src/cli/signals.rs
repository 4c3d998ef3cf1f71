//! Signals: interrupt and termination end a run with everything on disk, SIGUSR1 asks for a checkpoint.
//!
//! A second signal to end, while the first is waiting for the end of a step, ends the process at once: files are complete
//! or absent at any time, and the last checkpoint is still there.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, OnceLock};

use signal_hook::consts::{SIGINT, SIGTERM};

use super::INTERRUPTED;

/// What signals set.
#[derive(Debug, Clone, Default)]
pub struct Signals {
    /// The run is to end.
    pub interrupt: Arc<AtomicBool>,
    /// A checkpoint is wanted.
    pub checkpoint: Arc<AtomicBool>,
}

/// The flags of this process; signals are caught from the first call on.
pub fn listen() -> Signals {
    static SIGNALS: OnceLock<Signals> = OnceLock::new();
    let register = || {
        let signals = Signals::default();
        for signal in [SIGINT, SIGTERM] {
            // In this order: the first signal finds the flag unset. One that cannot be caught does what it always does.
            let end = Arc::clone(&signals.interrupt);
            let _ = signal_hook::flag::register_conditional_shutdown(signal, i32::from(INTERRUPTED), end);
            let _ = signal_hook::flag::register(signal, Arc::clone(&signals.interrupt));
        }
        #[cfg(unix)]
        let _ = signal_hook::flag::register(signal_hook::consts::SIGUSR1, Arc::clone(&signals.checkpoint));
        signals
    };
    SIGNALS.get_or_init(register).clone()
}
