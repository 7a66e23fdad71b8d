//! Datagrams that arrive at an address.

use std::net::{SocketAddr, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};

use super::senders::Senders;
use super::serve::{Heard, Link, is_passing};
use crate::fault::Fault;
use crate::place::Place;

/// The largest datagram that UDP over IP can carry fits.
const MAX_DATAGRAM: usize = 65_536;

/// A bound socket.
#[derive(Debug)]
pub(super) struct UdpLink {
    socket: UdpSocket,
    place: Place,
    senders: Senders,
    datagram: Vec<u8>,
}

impl UdpLink {
    /// Binds the address.
    pub(super) fn open(place: &Place, address: SocketAddr) -> Result<Self, Fault> {
        let bound = UdpSocket::bind(address)
            .and_then(|socket| socket.set_nonblocking(true).map(|()| socket));
        let socket = bound.map_err(|error| Fault::from_bind(place, &error))?;
        Ok(Self {
            socket,
            place: place.clone(),
            senders: Senders::default(),
            datagram: vec![0; MAX_DATAGRAM],
        })
    }
}

impl Link for UdpLink {
    fn sources(&self) -> Vec<BorrowedFd<'_>> {
        vec![self.socket.as_fd()]
    }

    fn hear(&mut self, now_ns: u64) -> Heard<'_> {
        match self.socket.recv_from(&mut self.datagram) {
            Ok((n_bytes, from)) if self.senders.admit(now_ns, from) => {
                Heard::Bytes(&self.datagram[..n_bytes])
            }
            Ok(_) => Heard::Refused,
            Err(error) if is_passing(error.kind()) => Heard::Nothing,
            Err(error) => Heard::Gone(Fault::Port {
                path: self.place.to_string(),
                detail: error.to_string(),
            }),
        }
    }

    /// To the sender that is heard; before there is one the bytes have nowhere to go.
    fn say(&mut self, bytes: &[u8]) -> Result<(), Fault> {
        if let Some(heard) = self.senders.heard() {
            // A datagram may be lost anywhere, and the sender may have gone: the session's own deadline acts.
            let _ = self.socket.send_to(bytes, heard);
        }
        Ok(())
    }

    fn complaint(&self, now_ns: u64) -> Option<Fault> {
        let other = self.senders.refused(now_ns)?;
        let heard = self.senders.heard()?;
        Some(Fault::SecondSender {
            place: self.place.to_string(),
            heard: heard.to_string(),
            other: other.to_string(),
        })
    }

    fn n_refused(&self) -> u64 {
        self.senders.n_refused
    }
}
