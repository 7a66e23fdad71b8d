//! The same bytes over raw TCP: what any server has to spend.

use std::io::ErrorKind;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::io::{AsyncReadExt, BufReader};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::MissedTickBehavior;

use crate::count::Count;
use crate::process::{Server, say};
use crate::{Outcome, RATE_HZ};

/// Bytes of HTTP/2 and gRPC around each message: a frame header and a length prefix.
const FRAMING_BYTES: usize = 9 + 5;
/// Before each raw message: the length of what follows, big-endian.
const LENGTH_BYTES: usize = 4;

/// Writes a message of that many bytes to every connection 60 times a second, until it is killed.
pub(crate) fn serve(message_bytes: usize) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    runtime.block_on(async {
        let listener = TcpListener::bind(SocketAddr::from(([127, 0, 0, 1], 0))).await?;
        say(listener.local_addr()?)?;
        let connections = Arc::new(Mutex::new(Vec::new()));
        tokio::spawn(write_all(
            Arc::clone(&connections),
            message_bytes + FRAMING_BYTES,
        ));
        loop {
            let (connection, _) = listener.accept().await?;
            connection.set_nodelay(true)?;
            connections
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(connection);
        }
    })
}

async fn write_all(connections: Arc<Mutex<Vec<TcpStream>>>, message_bytes: usize) {
    let length = message_bytes.saturating_sub(LENGTH_BYTES);
    let mut message = vec![0; LENGTH_BYTES + length];
    message[..LENGTH_BYTES].copy_from_slice(&(length as u32).to_be_bytes());
    let mut ticks = tokio::time::interval(Duration::from_secs_f64(1.0 / RATE_HZ));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        ticks.tick().await;
        let mut connections = connections.lock().unwrap_or_else(PoisonError::into_inner);
        connections.retain(|connection| match connection.try_write(&message) {
            // Half a message would break the stream; the buffers of a subscriber that reads are never that full.
            Ok(written) => written == message.len(),
            Err(fault) => fault.kind() == ErrorKind::WouldBlock,
        });
    }
}

/// Connects so often and measures.
pub(crate) async fn watch(server: &Server, n_subscribers: usize) -> anyhow::Result<Outcome> {
    let count = Arc::new(Count::default());
    let mut tasks = tokio::task::JoinSet::new();
    for _ in 0..n_subscribers {
        let connection = TcpStream::connect(server.address()).await?;
        let count = Arc::clone(&count);
        tasks.spawn(async move {
            // The connection ends when the server is killed.
            let _ = read(connection, &count).await;
        });
    }
    let outcome = count.measure(server, n_subscribers).await;
    tasks.shutdown().await;
    outcome
}

async fn read(connection: TcpStream, count: &Count) -> std::io::Result<()> {
    let mut connection = BufReader::new(connection);
    let mut message = Vec::new();
    let mut first = true;
    loop {
        let length = connection.read_u32().await? as usize;
        message.resize(length, 0);
        connection.read_exact(&mut message).await?;
        count.add((length + LENGTH_BYTES).saturating_sub(FRAMING_BYTES));
        if std::mem::replace(&mut first, false) {
            count.join();
        }
    }
}
