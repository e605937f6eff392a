//! The client that a call counts for in the daemon's shared limits.

use std::fmt;
use std::net::IpAddr;
use std::sync::Arc;

/// A client, as limits know it: it has one share, regardless of the name that it gives.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Account {
    /// The daemon's own process, which has no limit.
    Process,
    /// A token, by its name.
    Token(Arc<str>),
    /// All clients at an IPv4 address.
    Address(IpAddr),
    /// All clients in an IPv6 network, by its 64 bits.
    Network(u64),
    /// A connection from this machine.
    Connection(u64),
    /// A Zenoh session, by the id that it claims to have.
    Session(Arc<str>),
    /// All calls without a known client. They share the limits of one client.
    Unknown,
}

impl Account {
    /// Returns the account of a connection from an address.
    pub fn of_connection(number: u64, address: IpAddr) -> Self {
        match address.to_canonical() {
            address if address.is_loopback() => Self::Connection(number),
            IpAddr::V4(address) => Self::Address(address.into()),
            IpAddr::V6(address) => Self::Network((address.to_bits() >> 64) as u64),
        }
    }
}

impl fmt::Display for Account {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Process => f.write_str("this process"),
            Self::Token(name) => write!(f, "the token of {name}"),
            Self::Address(address) => write!(f, "{address}"),
            Self::Network(bits) => write!(f, "{}/64", std::net::Ipv6Addr::from_bits(u128::from(*bits) << 64)),
            Self::Connection(number) => write!(f, "connection {number}"),
            Self::Session(id) => write!(f, "session {id}"),
            Self::Unknown => f.write_str("unknown clients"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_network_has_one_account_and_connections_of_this_machine_have_one_each() {
        let of = |number, address: &str| Account::of_connection(number, address.parse().unwrap());
        assert_eq!(of(1, "10.0.0.7"), of(2, "10.0.0.7"));
        assert_eq!(of(1, "::ffff:10.0.0.7"), of(2, "10.0.0.7"));
        assert_ne!(of(1, "10.0.0.7"), of(1, "10.0.0.8"));
        assert_eq!(of(1, "2001:db8::1"), of(2, "2001:db8::2"));
        assert_eq!(of(1, "2001:db8::1").to_string(), "2001:db8::/64");
        assert_ne!(of(1, "127.0.0.1"), of(2, "127.0.0.1"));
    }
}
