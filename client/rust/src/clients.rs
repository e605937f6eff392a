//! Calls of the client service.

use simd_proto::v1::{ListClientsRequest, ListClientsResponse};

use crate::{Client, Error};

impl Client {
    /// Returns the active clients, and the clients that set joints' last targets.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn clients(&self) -> Result<ListClientsResponse, Error> {
        self.unary(self.clients_service().list_clients(ListClientsRequest {})).await
    }
}
