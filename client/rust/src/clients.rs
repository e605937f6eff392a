//! Calls of the client service.

use simd_proto::v1::{ListClientsRequest, ListClientsResponse};

use crate::{Client, Error};

impl Client {
    /// The clients that are here, and who set joints' last targets.
    ///
    /// # Errors
    /// None of its own.
    pub async fn clients(&self) -> Result<ListClientsResponse, Error> {
        self.unary(self.clients_service().list_clients(ListClientsRequest {})).await
    }
}
