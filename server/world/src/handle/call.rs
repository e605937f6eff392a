//! The context of a call: who makes it, with which rights, and which client it counts for. It is one value in
//! each handle, so that work in another task or on another thread keeps it.

use std::sync::Arc;

use simd_core::simulation::command::ClaimId;

use super::{CallError, Caller, Inner, Peer, RobotNote, SimHandle, Transport};
use crate::access::Grant;
use crate::account::Account;
use crate::driver::Sender;

/// Context of a call.
#[derive(Clone, Debug)]
pub struct CallContext {
    /// Client that the call counts for in shared limits, and owner of new objects.
    pub account: Account,
    /// Transport of the call.
    pub transport: Transport,
    /// Remote end of its connection, if known.
    pub peer: Option<Peer>,
    /// Caller, if it gives its name: the sender of commands.
    pub caller: Option<Caller>,
    /// Rights of its token, which may be limited to some robots.
    pub grant: Option<Arc<Grant>>,
    /// Claim that commands use, which the caller has verified.
    pub claim: Option<ClaimId>,
    /// Whether it may replace and delete objects of other owners.
    pub takes_over: bool,
    /// Note for the robots of the call.
    pub note: Option<RobotNote>,
}

impl CallContext {
    /// Makes the context of a call that counts for this client. It has no name, token or claim.
    pub fn of(account: Account) -> Self {
        Self {
            account,
            transport: Transport::Handle,
            peer: None,
            caller: None,
            grant: None,
            claim: None,
            takes_over: false,
            note: None,
        }
    }

    /// Returns the name of the caller, for recordings.
    pub(super) fn sender(&self) -> Sender {
        self.caller.as_ref().map(|caller| caller.name.clone())
    }

    /// Returns the robots that its commands may change; empty means all robots and the world.
    pub(super) fn only(&self) -> &[String] {
        self.grant.as_ref().map_or(&[], |grant| &grant.robots)
    }
}

impl SimHandle {
    /// Returns a handle for a call.
    #[must_use]
    pub fn of_call(&self, call: CallContext) -> Self {
        Self { inner: Arc::clone(&self.inner), call }
    }

    /// Returns a handle for work of the daemon itself, or of the program that embeds it: it has no limits.
    #[must_use]
    pub fn of_process(&self) -> Self {
        Self::of_daemon(Arc::clone(&self.inner))
    }

    /// Makes a handle for work of the daemon itself.
    pub(super) fn of_daemon(inner: Arc<Inner>) -> Self {
        Self { inner, call: CallContext::of(Account::Process) }
    }

    /// Returns a handle for the holder of a claim, which the caller has verified: each command renews its
    /// lease.
    #[must_use]
    pub fn acting_for(&self, claim: Option<ClaimId>) -> Self {
        self.of_call(CallContext { claim, ..self.call.clone() })
    }

    /// Returns a handle that may take over objects of others; the caller has verified that right.
    #[must_use]
    pub fn taking_over(&self, takes_over: bool) -> Self {
        self.of_call(CallContext { takes_over, ..self.call.clone() })
    }

    /// Returns the context of this handle's call.
    pub fn call(&self) -> &CallContext {
        &self.call
    }

    /// Refuses changes of robots that this handle is not for; `None` stands for the world.
    pub(crate) fn check_robots(&self, robots: Option<&[&str]>) -> Result<(), CallError> {
        let only = self.call.only();
        if only.is_empty() {
            return Ok(());
        }
        let other = match robots {
            Some(robots) => robots.iter().find(|robot| !only.iter().any(|only| only == *robot)),
            None => Some(&""),
        };
        match other {
            Some(robot) => {
                Err(CallError::RobotNotAllowed { robot: (*robot).to_owned(), allowed: only.to_vec() })
            }
            None => Ok(()),
        }
    }
}
