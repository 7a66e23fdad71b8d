//! Sends an emulator's datagrams to an address.

use std::io;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::Emulator;
use super::line_fault::Noise;

/// Longest that a request to stop goes unnoticed.
const STOP_LATENCY: Duration = Duration::from_millis(20);

/// What is asked of the sending thread.
#[derive(Debug)]
struct Orders {
    stop: AtomicBool,
    unplugged: AtomicBool,
    /// End of a time in which nothing is sent, ns since the start.
    silent_until_ns: AtomicU64,
    noise: Mutex<Noise>,
}

/// An emulator that runs on a thread of its own and sends datagrams; it ends when this is dropped.
#[derive(Debug)]
pub struct UdpEmulator<E> {
    emulator: Arc<Mutex<E>>,
    orders: Arc<Orders>,
    to: SocketAddr,
    /// The program as it was started.
    at_start: E,
    origin: Instant,
    thread: Option<JoinHandle<()>>,
}

impl<E: Emulator + Clone + Send + 'static> UdpEmulator<E> {
    /// Starts to send what the emulator polls, each poll as one datagram, to `HOST:PORT`. `motion` is called before each
    /// poll, with ns since the start, and may bend and move it.
    ///
    /// # Errors
    /// When the host has no address, or the system has no socket or thread to give.
    pub fn spawn<M>(emulator: E, to: &str, motion: M) -> io::Result<Self>
    where
        M: FnMut(u64, &mut E) + Send + 'static,
    {
        let no_address = || io::Error::new(io::ErrorKind::NotFound, format!("{to}: no address"));
        let to = to.to_socket_addrs()?.next().ok_or_else(no_address)?;
        let own = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
        let socket = UdpSocket::bind(own)?;
        let at_start = emulator.clone();
        let origin = Instant::now();
        let emulator = Arc::new(Mutex::new(emulator));
        let orders = Arc::new(Orders {
            stop: AtomicBool::new(false),
            unplugged: AtomicBool::new(false),
            silent_until_ns: AtomicU64::new(0),
            noise: Mutex::new(Noise::new(0.0)),
        });
        let mut run = Run {
            emulator: Arc::clone(&emulator),
            orders: Arc::clone(&orders),
            motion,
            socket,
            to,
            origin,
        };
        let thread = std::thread::Builder::new()
            .name("emulated sender".to_owned())
            .spawn(move || run.run())?;
        Ok(Self {
            emulator,
            orders,
            to,
            at_start,
            origin,
            thread: Some(thread),
        })
    }

    /// Where it sends.
    #[must_use]
    pub const fn to(&self) -> SocketAddr {
        self.to
    }

    /// Bends, moves or breaks the device.
    pub fn with<T>(&self, change: impl FnOnce(&mut E) -> T) -> T {
        // A panic in another caller's closure leaves a device that is still worth talking to.
        change(&mut self.emulator.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// From now on sends nothing, or sends again.
    pub fn set_unplugged(&self, unplugged: bool) {
        self.orders.unplugged.store(unplugged, Ordering::Release);
    }

    /// Sends nothing for a time, then goes on as if nothing had been.
    pub fn stall(&self, time: Duration) {
        let end_ns = (self.origin.elapsed() + time).as_nanos() as u64;
        self.orders.silent_until_ns.store(end_ns, Ordering::Release);
    }

    /// Sends nothing for a time, and begins then as it was started.
    pub fn restart(&self, time: Duration) {
        self.stall(time);
        self.with(|emulator| emulator.clone_from(&self.at_start));
    }

    /// From now on replaces this share of the bytes, 0 to 1.
    pub fn spoil(&self, share: f64) {
        let noise = &self.orders.noise;
        *noise.lock().unwrap_or_else(PoisonError::into_inner) = Noise::new(share);
    }
}

impl<E> Drop for UdpEmulator<E> {
    fn drop(&mut self) {
        self.orders.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

struct Run<E, M> {
    emulator: Arc<Mutex<E>>,
    orders: Arc<Orders>,
    motion: M,
    socket: UdpSocket,
    to: SocketAddr,
    origin: Instant,
}

impl<E: Emulator, M: FnMut(u64, &mut E)> Run<E, M> {
    fn run(&mut self) {
        while !self.orders.stop.load(Ordering::Acquire) {
            let now_ns = self.origin.elapsed().as_nanos() as u64;
            let (mut datagram, deadline_ns) = {
                let mut emulator = self.emulator.lock().unwrap_or_else(PoisonError::into_inner);
                (self.motion)(now_ns, &mut emulator);
                (emulator.poll(now_ns), emulator.deadline())
            };
            if !datagram.is_empty() {
                self.send(&mut datagram);
            }
            let rest_ns = deadline_ns.map_or(u64::MAX, |at_ns| at_ns.saturating_sub(now_ns));
            if rest_ns > 0 {
                std::thread::park_timeout(Duration::from_nanos(rest_ns).min(STOP_LATENCY));
            }
        }
    }

    fn send(&self, datagram: &mut [u8]) {
        let silent_until_ns = self.orders.silent_until_ns.load(Ordering::Acquire);
        let now_ns = self.origin.elapsed().as_nanos() as u64;
        if self.orders.unplugged.load(Ordering::Acquire) || now_ns < silent_until_ns {
            return;
        }
        let noise = &self.orders.noise;
        noise
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .spoil(datagram);
        // Nobody may be listening yet, which the system says of the datagram before.
        let _ = self.socket.send_to(datagram, self.to);
    }
}
