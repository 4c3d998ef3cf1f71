//! Work without the interpreter's lock. The calling thread waits, lets Python handle signals now and then, and calls
//! back; so Ctrl-C and callbacks work in the thread where Python wants them, whatever threads compute.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use pyo3::prelude::*;
use rayon::ThreadPool;

use crate::errors::Trouble;

/// Between two looks at the signals.
const PATIENCE: Duration = Duration::from_millis(50);

/// A pool of its own size, or none: the one that all share.
///
/// # Errors
/// If the number is zero or the threads cannot be started.
pub fn pool(threads: Option<usize>) -> Result<Option<ThreadPool>, Trouble> {
    let Some(threads) = threads else { return Ok(None) };
    if threads == 0 {
        return Err(Trouble::Argument("threads=0: at least one thread is needed".into()));
    }
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    built.map(Some).map_err(|error| Trouble::Argument(format!("threads={threads} cannot be started: {error}")))
}

/// Calls `work` with a panic made an error.
fn sound<T>(pool: Option<&ThreadPool>, work: impl FnOnce() -> Result<T, Trouble> + Send) -> Result<T, Trouble>
where
    T: Send,
{
    let inside = || match pool {
        Some(pool) => pool.install(work),
        None => work(),
    };
    catch_unwind(AssertUnwindSafe(inside)).unwrap_or_else(|panic| Err(Trouble::Panic(words(&*panic))))
}

fn words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".into())
}

/// Short work: other Python threads go on meanwhile; signals wait.
pub fn short<T: Send>(
    py: Python<'_>,
    pool: Option<&ThreadPool>,
    work: impl FnOnce() -> Result<T, Trouble> + Send,
) -> PyResult<T> {
    py.detach(|| sound(pool, work)).map_err(|trouble| trouble.raise(py))
}

/// What work that goes on may tell the calling thread.
enum Message<M> {
    /// Something for the callback; the answer says whether to go on.
    Call(M),
    Done,
}

/// The other end of a callback.
pub struct Caller<M> {
    messages: SyncSender<Message<M>>,
    answers: Mutex<Receiver<()>>,
}

impl<M: Send> Caller<M> {
    /// Has the callback called in the calling thread, and waits for it. What it wants is in the stop flag.
    pub fn call(&self, message: M) {
        if self.messages.send(Message::Call(message)).is_ok() {
            let _ = self.answers.lock().unwrap_or_else(PoisonError::into_inner).recv();
        }
    }
}

/// What became of long work.
pub struct Ended<T> {
    /// Its result.
    pub outcome: Result<T, Trouble>,
    /// What a signal or the callback raised; the work was then asked to stop.
    pub raised: Option<PyErr>,
}

/// Long work: a signal or the callback may set `stop`, which the work looks at. The callback says whether to stop.
pub fn long<T: Send, M: Send>(
    py: Python<'_>,
    pool: Option<&ThreadPool>,
    stop: &AtomicBool,
    mut callback: impl FnMut(Python<'_>, M) -> PyResult<bool>,
    work: impl FnOnce(&Caller<M>) -> Result<T, Trouble> + Send,
) -> Ended<T> {
    stop.store(false, Ordering::Relaxed);
    let (messages, inbox) = sync_channel(1);
    let (replies, answers) = sync_channel(1);
    let caller = Caller { messages: messages.clone(), answers: Mutex::new(answers) };
    let inbox = Mutex::new(inbox);
    let mut raised = None;
    let outcome = std::thread::scope(|scope| {
        let worker = scope.spawn(move || {
            let outcome = sound(pool, || work(&caller));
            let _ = messages.send(Message::Done);
            outcome
        });
        loop {
            let message = py.detach(|| inbox.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(PATIENCE));
            let wish = match message {
                Ok(Message::Done) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(Message::Call(message)) => {
                    let wish = if raised.is_none() { callback(py, message) } else { Ok(true) };
                    // Told before the work goes on: it stops after this very step.
                    if !matches!(wish, Ok(false)) {
                        stop.store(true, Ordering::Relaxed);
                    }
                    let _ = replies.send(());
                    wish.map(drop)
                }
                Err(RecvTimeoutError::Timeout) => py.check_signals(),
            };
            if let Err(error) = wish
                && raised.is_none()
            {
                raised = Some(error);
                stop.store(true, Ordering::Relaxed);
            }
        }
        py.detach(|| worker.join())
    });
    let outcome = outcome.unwrap_or_else(|panic| Err(Trouble::Panic(words(&*panic))));
    // A signal that came in the last moments.
    if raised.is_none() {
        raised = py.check_signals().err();
    }
    Ended { outcome, raised }
}
