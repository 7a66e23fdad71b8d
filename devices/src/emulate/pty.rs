//! Plugs an emulator into a pseudo-terminal, at the pace of a real line.

use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use nix::errno::Errno;
use nix::fcntl::{FcntlArg, FdFlag, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, ppoll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::sys::time::TimeSpec;
use nix::unistd::{read, ttyname, write};

use crate::emulate::Emulator;
use crate::emulate::line_fault::Noise;

/// Longest that an order to plug, unplug or stop goes unnoticed, ns.
const ORDER_LATENCY_NS: u64 = 2_000_000;
/// Bytes waiting for the line; what a device says beyond that is lost, as on a real UART.
const MAX_WAITING: usize = 4096;

/// Where the emulated device is plugged in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PtySettings {
    /// A symbolic link that is made for the terminal while the device is plugged in, and re-pointed when it comes
    /// back on another terminal, as `/dev/serial/by-id` does. Only a link is ever replaced.
    pub link: Option<PathBuf>,
    /// Line rate in bit/s, ten bits a byte; 0 for no pacing.
    pub baud: u32,
}

impl Default for PtySettings {
    /// No link, 115200 bit/s.
    fn default() -> Self {
        Self {
            link: None,
            baud: 115_200,
        }
    }
}

enum Order {
    Plug(SyncSender<io::Result<PathBuf>>),
    Unplug(SyncSender<()>),
    Noise(Noise),
    Silence { time: Duration, is_power_cut: bool },
    Stop,
}

/// An emulator that runs on a thread of its own behind a pseudo-terminal; it ends when this is dropped.
#[derive(Debug)]
pub struct PtyEmulator<E> {
    emulator: Arc<Mutex<E>>,
    orders: SyncSender<Order>,
    thread: Option<JoinHandle<()>>,
    path: PathBuf,
}

impl<E: Emulator + Clone + Send + 'static> PtyEmulator<E> {
    /// Opens a pseudo-terminal and starts the device. `motion` is called before each time the device is asked for
    /// bytes, with ns since the start, and may bend and move it.
    ///
    /// # Errors
    /// When the system has no pseudo-terminal or thread to give, or the link cannot be made.
    pub fn spawn<M>(emulator: E, settings: PtySettings, motion: M) -> io::Result<Self>
    where
        M: FnMut(u64, &mut E) + Send + 'static,
    {
        let at_power_on = emulator.clone();
        let emulator = Arc::new(Mutex::new(emulator));
        let pty = Pty::open(settings.link.as_deref())?;
        let path = pty.path.clone();
        let (orders, inbox) = sync_channel(4);
        let mut run = Run {
            emulator: Arc::clone(&emulator),
            motion,
            settings,
            pty: Some(pty),
            inbox,
            origin: Instant::now(),
            waiting: Vec::new(),
            line_free_ns: 0,
            noise: Noise::new(0.0),
            at_power_on,
            silence: None,
        };
        let thread = std::thread::Builder::new()
            .name("emulated device".to_owned())
            .spawn(move || while run.turn() {})?;
        Ok(Self {
            emulator,
            orders,
            thread: Some(thread),
            path,
        })
    }

    /// The terminal of the present, or last, plugging in.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bends, moves or breaks the device.
    pub fn with<T>(&self, change: impl FnOnce(&mut E) -> T) -> T {
        // A panic in another caller's closure leaves a device that is still worth talking to.
        change(&mut self.emulator.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// From now on replaces this share of the bytes that the device says, 0 to 1.
    pub fn spoil(&self, share: f64) {
        // An error means that the thread has ended, and there is nothing to spoil.
        let _ = self.orders.send(Order::Noise(Noise::new(share)));
    }

    /// Says and hears nothing for a time, then goes on as if nothing had been.
    pub fn stall(&self, time: Duration) {
        self.fall_silent(time, false);
    }

    /// Loses its power in the middle of what it says, and comes back after that time as it was when it was made: set to
    /// nothing, and asked for nothing.
    pub fn cut_power(&self, time: Duration) {
        self.fall_silent(time, true);
    }

    fn fall_silent(&self, time: Duration, is_power_cut: bool) {
        // An error means that the thread has ended, and is silent.
        let _ = self.orders.send(Order::Silence { time, is_power_cut });
    }

    /// Pulls the cable: the terminal hangs up and the link disappears. The device keeps its state.
    pub fn unplug(&self) {
        let (done, wait) = sync_channel(1);
        if self.orders.send(Order::Unplug(done)).is_ok() {
            // An error means that the thread has ended, and the terminal with it.
            let _ = wait.recv();
        }
    }

    /// Plugs the cable in again, on a new terminal, and re-points the link. Returns the terminal's path.
    ///
    /// # Errors
    /// When the system has no pseudo-terminal to give, or the link cannot be made.
    pub fn plug(&mut self) -> io::Result<PathBuf> {
        let (done, wait) = sync_channel(1);
        let gone = || io::Error::other("the emulator has ended");
        self.orders
            .send(Order::Plug(done))
            .map_err(|_send| gone())?;
        self.path = wait.recv().map_err(|_receive| gone())??;
        Ok(self.path.clone())
    }
}

impl<E> Drop for PtyEmulator<E> {
    fn drop(&mut self) {
        // An error means that the thread has ended already.
        let _ = self.orders.send(Order::Stop);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[derive(Debug)]
struct Pty {
    master: OwnedFd,
    /// Kept open, for the master cannot be read while no one has the slave open.
    _slave: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
}

impl Pty {
    fn open(link: Option<&Path>) -> io::Result<Self> {
        let pair = openpty(None, None)?;
        for end in [&pair.master, &pair.slave] {
            fcntl(end, FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC))?;
        }
        // Raw before the first byte, or the terminal echoes the device's own bytes back to it.
        let mut termios = tcgetattr(&pair.slave)?;
        cfmakeraw(&mut termios);
        tcsetattr(&pair.slave, SetArg::TCSANOW, &termios)?;
        fcntl(&pair.master, FcntlArg::F_SETFL(OFlag::O_NONBLOCK))?;
        let path = ttyname(&pair.slave)?;
        if let Some(link) = link {
            point_link(link, &path)?;
        }
        Ok(Self {
            master: pair.master,
            _slave: pair.slave,
            path,
            link: link.map(Path::to_path_buf),
        })
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = &self.link {
            // Someone else may have removed or re-pointed it, which is theirs to do.
            if std::fs::read_link(link).is_ok_and(|target| target == self.path) {
                let _ = std::fs::remove_file(link);
            }
        }
    }
}

fn point_link(link: &Path, target: &Path) -> io::Result<()> {
    match std::fs::symlink_metadata(link) {
        Ok(metadata) if metadata.is_symlink() => std::fs::remove_file(link)?,
        Ok(_) => {
            let text = format!("{} exists and is no link", link.display());
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, text));
        }
        Err(_) => {}
    }
    std::os::unix::fs::symlink(target, link)
}

struct Run<E, M> {
    emulator: Arc<Mutex<E>>,
    motion: M,
    settings: PtySettings,
    pty: Option<Pty>,
    inbox: Receiver<Order>,
    origin: Instant,
    /// Said by the device and not yet on the line.
    waiting: Vec<u8>,
    /// When the line has sent what it was given, ns.
    line_free_ns: u64,
    noise: Noise,
    /// The device as it was made.
    at_power_on: E,
    silence: Option<Silence>,
}

/// A time in which the device neither hears nor speaks.
#[derive(Clone, Copy)]
struct Silence {
    end_ns: u64,
    is_power_cut: bool,
    /// Whether it has begun, by what was being said cut in two.
    has_begun: bool,
}

impl<E: Emulator + Clone, M: FnMut(u64, &mut E)> Run<E, M> {
    fn now_ns(&self) -> u64 {
        self.origin.elapsed().as_nanos() as u64
    }

    /// One round: orders, the device, the line. False at the end.
    fn turn(&mut self) -> bool {
        while let Ok(order) = self.inbox.try_recv() {
            match order {
                Order::Stop => return false,
                Order::Noise(noise) => self.noise = noise,
                Order::Silence { time, is_power_cut } => {
                    self.silence = Some(Silence {
                        end_ns: self.now_ns() + time.as_nanos() as u64,
                        is_power_cut,
                        has_begun: false,
                    });
                }
                Order::Unplug(done) => {
                    self.pty = None;
                    let _ = done.send(());
                }
                Order::Plug(done) => {
                    self.pty = None;
                    let result = Pty::open(self.settings.link.as_deref()).map(|pty| {
                        let path = pty.path.clone();
                        self.pty = Some(pty);
                        path
                    });
                    let _ = done.send(result);
                }
            }
        }
        let now_ns = self.now_ns();
        let heard = self.hear();
        let deadline_ns = if self.is_silent(now_ns) {
            None
        } else {
            let mut emulator = self.emulator.lock().unwrap_or_else(PoisonError::into_inner);
            (self.motion)(now_ns, &mut emulator);
            emulator.push(now_ns, &heard);
            if self.waiting.is_empty() {
                // An idle line does not save its time up for later.
                self.line_free_ns = self.line_free_ns.max(now_ns);
            }
            let mut said = emulator.poll(now_ns);
            self.noise.spoil(&mut said);
            if let Some(silence) = self.silence.as_mut().filter(|_| said.len() > 1) {
                // In the middle of a record.
                said.truncate(said.len() / 2);
                silence.has_begun = true;
            }
            self.waiting.extend(said);
            emulator.deadline()
        };
        // The newest is kept whole: what does not fit behind the waiting bytes was never sent.
        self.waiting.truncate(MAX_WAITING);
        self.send(now_ns);
        self.wait(deadline_ns);
        true
    }

    /// Whether the device is silent at present. A power cut ends with the device as it was made.
    fn is_silent(&mut self, now_ns: u64) -> bool {
        let Some(silence) = self.silence else {
            return false;
        };
        if now_ns < silence.end_ns {
            return silence.has_begun;
        }
        self.silence = None;
        if silence.is_power_cut {
            let mut emulator = self.emulator.lock().unwrap_or_else(PoisonError::into_inner);
            *emulator = self.at_power_on.clone();
        }
        false
    }

    fn hear(&self) -> Vec<u8> {
        let mut bytes = [0; 512];
        let heard = self
            .pty
            .as_ref()
            .map_or(Ok(0), |pty| read(&pty.master, &mut bytes));
        // EAGAIN: nothing was said. EIO cannot be: this side keeps the slave open.
        bytes[..heard.unwrap_or(0)].to_vec()
    }

    /// Puts as many bytes on the line as had time to pass since it was free.
    fn send(&mut self, now_ns: u64) {
        let Some(pty) = &self.pty else {
            self.waiting.clear();
            return;
        };
        if self.waiting.is_empty() {
            return;
        }
        let n_bytes = match byte_time_ns(self.settings.baud) {
            0 => self.waiting.len(),
            byte_ns => {
                let passed = (now_ns.saturating_sub(self.line_free_ns) / byte_ns) as usize;
                let n_bytes = passed.min(self.waiting.len());
                self.line_free_ns += n_bytes as u64 * byte_ns;
                n_bytes
            }
        };
        let sent = match write(&pty.master, &self.waiting[..n_bytes]) {
            Ok(sent) => sent,
            // Nobody reads: the bytes are lost, as on a real line.
            Err(Errno::EAGAIN) => n_bytes,
            Err(_) => 0,
        };
        self.waiting.drain(..sent.max(n_bytes));
    }

    /// Until the host speaks, the device is due, the line is free again, or an order may have come.
    fn wait(&self, deadline_ns: Option<u64>) {
        let now_ns = self.now_ns();
        let device_ns = deadline_ns.map_or(ORDER_LATENCY_NS, |at_ns| at_ns.saturating_sub(now_ns));
        let mut wait_ns = device_ns.min(ORDER_LATENCY_NS);
        if !self.waiting.is_empty() {
            // A few bytes at a time, as the line's own buffer hands them over.
            wait_ns = wait_ns
                .min(8 * byte_time_ns(self.settings.baud))
                .max(100_000);
        }
        let timeout = TimeSpec::new(0, wait_ns as i64);
        match &self.pty {
            Some(pty) => {
                let mut watched = [PollFd::new(pty.master.as_fd(), PollFlags::POLLIN)];
                // Whether it ended by time, by data or by a signal, the next round looks at everything.
                let _ = ppoll(&mut watched, Some(timeout), None);
            }
            None => {
                let _ = ppoll(&mut [], Some(timeout), None);
            }
        }
    }
}

const fn byte_time_ns(baud: u32) -> u64 {
    match baud {
        0 => 0,
        baud => 10_000_000_000 / baud as u64,
    }
}
