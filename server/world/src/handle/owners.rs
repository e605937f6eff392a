//! Owners of saved states, parameters and markers, and the right to replace or delete these.
//!
//! Objects made with a claim belong to its holder while the claim is active. Objects made with a token belong
//! to its owner while the token exists. All others belong to everybody: without tokens, callers cannot be
//! distinguished.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Mutex, PoisonError};

use simd_core::simulation::command::ClaimId;
use simd_core::{Command, Reply};

use super::{CallContext, CallError, Done, SimHandle};
use crate::account::Account;
use crate::driver::Sender;

/// Owner of an object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Owner {
    account: Account,
    /// Name of the client, as it calls itself.
    client: Sender,
    /// Claim that it was made with.
    claim: Option<ClaimId>,
}

impl Owner {
    /// Returns the account that its objects count for.
    pub(super) fn account(&self) -> &Account {
        &self.account
    }
}

/// Writes the name of the token, otherwise the client's name and address. Empty for the daemon itself.
impl fmt::Display for Owner {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.account, &self.client) {
            (Account::Token(name), _) => f.write_str(name),
            (Account::Process, None) => Ok(()),
            (Account::Process, Some(client)) => f.write_str(client),
            (account, None) => write!(f, "{account}"),
            (account, Some(client)) => write!(f, "{client}, {account}"),
        }
    }
}

/// Owners of saved states, by name.
#[derive(Debug, Default)]
pub(super) struct SavedStateOwners {
    /// Held from the check of an owner until the state has changed.
    changing: tokio::sync::Mutex<()>,
    /// Locked for a look or a change.
    by_name: Mutex<BTreeMap<String, Owner>>,
}

impl SavedStateOwners {
    fn get(&self, name: &str) -> Option<Owner> {
        self.by_name.lock().unwrap_or_else(PoisonError::into_inner).get(name).cloned()
    }

    /// Returns how many states a client has, not counting this name.
    fn count_beside(&self, name: &str, account: &Account) -> usize {
        let by_name = self.by_name.lock().unwrap_or_else(PoisonError::into_inner);
        by_name.iter().filter(|(other, owner)| other.as_str() != name && owner.account == *account).count()
    }
}

impl SimHandle {
    /// Returns the owner of objects that this handle makes.
    pub(super) fn owner(&self) -> Owner {
        Owner { account: self.call.account.clone(), client: self.call.sender(), claim: self.call.claim }
    }

    /// Returns whether this handle may replace or delete an owner's object.
    pub(super) fn owns(&self, owner: &Owner) -> bool {
        let is_claimed = owner.claim.is_some_and(|claim| self.inner.leases.holds(claim));
        let CallContext { account, claim, takes_over, .. } = &self.call;
        let is_of_token = matches!(owner.account, Account::Token(_)) && *account != Account::Process;
        *takes_over || !(is_claimed && *claim != owner.claim || is_of_token && *account != owner.account)
    }

    /// Refuses callers that do not own `what`.
    pub(super) fn check_owner(&self, what: impl FnOnce() -> String, owner: &Owner) -> Result<(), CallError> {
        match self.owns(owner) {
            true => Ok(()),
            false => Err(CallError::OwnedByAnother { what: what(), owner: owner.to_string() }),
        }
    }

    /// Returns the owner of a saved state.
    pub fn saved_state_owner(&self, name: &str) -> Option<Owner> {
        self.inner.saved_state_owners.get(name)
    }

    /// Saves, replaces or forgets a saved state, if the caller may. A separate task, so that no state is left
    /// without its owner if the caller disconnects.
    pub(super) async fn change_saved_state(&self, command: Command) -> Result<Done, CallError> {
        let changed = tokio::spawn(self.clone().change_saved_state_alone(command)).await;
        changed.map_err(|error| CallError::Internal { message: error.to_string() })?
    }

    async fn change_saved_state_alone(self, command: Command) -> Result<Done, CallError> {
        let owners = &self.inner.saved_state_owners;
        let _guard = owners.changing.lock().await;
        let named = match &command {
            Command::SaveState { name }
            | Command::DeleteSavedState { name }
            | Command::ImportSavedState { name, .. } => name.as_str(),
            _ => "",
        };
        let limits = &self.inner.info.limits;
        let keeps = !matches!(command, Command::DeleteSavedState { .. });
        // The world has room for one, which is for a state that is restored at the start.
        if limits.saved_states == 0 && keeps {
            let what = "the number of saved states".into();
            return Err(CallError::LimitExceeded { what, value: 1, limit: 0 });
        }
        if let Some(owner) = owners.get(named) {
            self.check_owner(|| format!("saved state {named:?}"), &owner)?;
        }
        if keeps {
            let count = owners.count_beside(named, &self.call.account) + 1;
            self.check_share("the number of saved states", count, limits.saved_states_of_client)?;
        }
        let done = self.post(command).await?;
        // Owners of deleted states are removed too.
        let newest = self.newest();
        let mut by_name = owners.by_name.lock().unwrap_or_else(PoisonError::into_inner);
        by_name.retain(|name, _| newest.state.saved(name).is_ok());
        if let Reply::SavedState(info) = &done.applied.reply {
            by_name.insert(info.name.clone(), self.owner());
        }
        Ok(done)
    }
}
