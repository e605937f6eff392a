//! Whose saved states, parameters and markers are, and who may replace or take them away.
//!
//! What was made with a claim is its holder's as long as the claim holds. What was made with a token is its owner's as
//! long as it is there. All else is everybody's: without tokens one caller looks like another.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Mutex, PoisonError};

use simd_core::simulation::command::ClaimId;
use simd_core::{Command, Reply};

use super::{CallError, Done, SimHandle};
use crate::account::Account;
use crate::driver::Sender;

/// Who made something.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Owner {
    account: Account,
    /// As it calls itself.
    client: Sender,
    /// That it was made with.
    claim: Option<ClaimId>,
}

impl Owner {
    /// Whom what it made counts for.
    pub(super) fn account(&self) -> &Account {
        &self.account
    }
}

/// The name of a token; else that of the client, and where it comes from. Empty for the daemon itself.
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

/// The owners of saved states, by their names.
#[derive(Debug, Default)]
pub(super) struct SavedStateOwners {
    /// Held from the look at an owner until the state is another's.
    changing: tokio::sync::Mutex<()>,
    /// Held for a look or a change.
    by_name: Mutex<BTreeMap<String, Owner>>,
}

impl SavedStateOwners {
    fn get(&self, name: &str) -> Option<Owner> {
        self.by_name.lock().unwrap_or_else(PoisonError::into_inner).get(name).cloned()
    }

    /// How many a client has beside the one of this name.
    fn count_beside(&self, name: &str, account: &Account) -> usize {
        let by_name = self.by_name.lock().unwrap_or_else(PoisonError::into_inner);
        by_name.iter().filter(|(other, owner)| other.as_str() != name && owner.account == *account).count()
    }
}

impl SimHandle {
    /// The same for who takes over what is another's, where the caller has found that it may.
    #[must_use]
    pub fn taking_over(&self, takes_over: bool) -> Self {
        Self { takes_over, ..self.clone() }
    }

    /// Whom what this handle makes belongs to.
    pub(super) fn owner(&self) -> Owner {
        Owner { account: self.account.clone(), client: self.sender.clone(), claim: self.claim }
    }

    /// Whether this handle may replace or take away what an owner made.
    pub(super) fn owns(&self, owner: &Owner) -> bool {
        let is_claimed = owner.claim.is_some_and(|claim| self.inner.leases.holds(claim));
        let is_of_token = matches!(owner.account, Account::Token(_)) && self.account != Account::Process;
        self.takes_over
            || !(is_claimed && self.claim != owner.claim || is_of_token && self.account != owner.account)
    }

    /// Refuses who does not own `what`.
    pub(super) fn check_owner(&self, what: impl FnOnce() -> String, owner: &Owner) -> Result<(), CallError> {
        match self.owns(owner) {
            true => Ok(()),
            false => Err(CallError::OwnedByAnother { what: what(), owner: owner.to_string() }),
        }
    }

    /// Whose a saved state is.
    pub fn saved_state_owner(&self, name: &str) -> Option<Owner> {
        self.inner.saved_state_owners.get(name)
    }

    /// Keeps, replaces or forgets a saved state, if it is the caller's to do. A task of its own, so that a caller who
    /// goes away leaves no state without its owner.
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
            let count = owners.count_beside(named, &self.account) + 1;
            self.check_share("the number of saved states", count, limits.saved_states_of_client)?;
        }
        let done = self.post(command).await?;
        // Those of states that are gone go too.
        let newest = self.newest();
        let mut by_name = owners.by_name.lock().unwrap_or_else(PoisonError::into_inner);
        by_name.retain(|name, _| newest.state.saved(name).is_ok());
        if let Reply::SavedState(info) = &done.applied.reply {
            by_name.insert(info.name.clone(), self.owner());
        }
        Ok(done)
    }
}
