//! Markers and cameras of the viewer's pages, and input from their keys and mouse.

use std::time::Duration;

use simd_proto::v1::{
    AddMarkersRequest, DeleteMarkersRequest, GetCamerasRequest, GetCamerasResponse, LinkColor,
    ListMarkersRequest, Marker, MarkerLines, MarkerPoints, MarkerText, NextInputRequest, NextInputResponse,
    NextViewRequest, NextViewResponse, ReportViewRequest, ReportViewResponse, SetCameraRequest,
    SetLinkColorsRequest, Vector3, marker::Shape,
};

use crate::{Client, Error, simulation::wall_seconds};

/// Makes straight lines from one point to another, metres; `width` in CSS pixels.
pub fn lines<'p>(ends: impl IntoIterator<Item = &'p [[f32; 3]; 2]>, width: f32) -> Marker {
    let points = ends.into_iter().flatten().flatten().copied().collect();
    let shape = Shape::Lines(MarkerLines { points, colors: Vec::new(), width });
    Marker { shape: Some(shape), ..Default::default() }
}

/// Makes dots, metres; `size` in CSS pixels.
pub fn points<'p>(points: impl IntoIterator<Item = &'p [f32; 3]>, size: f32) -> Marker {
    let points = points.into_iter().flatten().copied().collect();
    let shape = Shape::Points(MarkerPoints { points, colors: Vec::new(), size });
    Marker { shape: Some(shape), ..Default::default() }
}

/// Makes a text that faces the camera; position and height of a line in metres.
pub fn text(text: impl Into<String>, position: Vector3, size: f64) -> Marker {
    let text = text.into();
    let shape = Shape::Text(MarkerText { text, position: Some(position), orientation: None, size });
    Marker { shape: Some(shape), ..Default::default() }
}

/// `ViewService`.
impl Client {
    /// Adds markers, all of them or none. With `until_disconnect` they are deleted when this connection ends.
    /// Returns their ids.
    ///
    /// # Errors
    /// `INVALID_VALUE`, `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `OWNED_BY_ANOTHER`, `LIMIT_EXCEEDED`.
    pub async fn add_markers(
        &self,
        markers: impl IntoIterator<Item = Marker>,
        until_disconnect: bool,
    ) -> Result<Vec<u64>, Error> {
        let (markers, take_over) = (markers.into_iter().collect(), self.takes_over);
        let request = AddMarkersRequest { markers, until_disconnect, take_over, ..Default::default() };
        Ok(self.unary(self.view().add_markers(request)).await?.ids)
    }

    /// Deletes markers. Without ids, deletes all that have no other owner. Returns the ids of the deleted
    /// ones.
    ///
    /// # Errors
    /// `OWNED_BY_ANOTHER`.
    pub async fn delete_markers(&self, ids: Vec<u64>) -> Result<Vec<u64>, Error> {
        let request = DeleteMarkersRequest { ids, take_over: self.takes_over, ..Default::default() };
        Ok(self.unary(self.view().delete_markers(request)).await?.deleted)
    }

    /// Returns all markers, in the order in which they were added.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn markers(&self) -> Result<Vec<Marker>, Error> {
        Ok(self.unary(self.view().list_markers(ListMarkersRequest {})).await?.markers)
    }

    /// Returns the changes for a page since a version (0: all of it), once there are some, or after `wait`,
    /// at most 60 s.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn next_view(&self, after_version: u64, wait: Duration) -> Result<NextViewResponse, Error> {
        let timeout = wait.as_secs_f64();
        let request = NextViewRequest { after_version, timeout };
        self.unary_for(wall_seconds(timeout), self.view().next_view(request)).await
    }

    /// For pages: reports the camera, and input from keys and mouse.
    ///
    /// # Errors
    /// `INVALID_VALUE`.
    pub async fn report_view(&self, request: ReportViewRequest) -> Result<ReportViewResponse, Error> {
        self.unary(self.view().report_view(request)).await
    }

    /// Moves the cameras of all pages to a position, looking at a target. The field of view is in radians;
    /// `None` does not change it.
    ///
    /// # Errors
    /// `INVALID_VALUE`.
    pub async fn set_camera(
        &self,
        position: Vector3,
        target: Vector3,
        field_of_view: Option<f64>,
    ) -> Result<u64, Error> {
        let field_of_view = field_of_view.unwrap_or_default();
        let (position, target) = (Some(position), Some(target));
        let request = SetCameraRequest { position, target, field_of_view, ..Default::default() };
        Ok(self.unary(self.view().set_camera(request)).await?.version)
    }

    /// Overrides the colours of links in pages; without a colour, restores the description's. All or none.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn set_link_colors(&self, colors: impl IntoIterator<Item = LinkColor>) -> Result<(), Error> {
        let request = SetLinkColorsRequest { colors: colors.into_iter().collect(), ..Default::default() };
        self.unary(self.view().set_link_colors(request)).await.map(|_| ())
    }

    /// Returns the cameras of the open pages; the one that moved last comes first.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn cameras(&self) -> Result<GetCamerasResponse, Error> {
        self.unary(self.view().get_cameras(GetCamerasRequest {})).await
    }

    /// Returns key and mouse events in pages after a sequence, once there are some, or after `wait`, at most
    /// 60 s. Without a sequence, returns only the newest sequence, from which to continue.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn next_input(
        &self,
        after_sequence: Option<u64>,
        wait: Duration,
    ) -> Result<NextInputResponse, Error> {
        let timeout = wait.as_secs_f64();
        let request = NextInputRequest { after_sequence, timeout };
        self.unary_for(wall_seconds(timeout), self.view().next_input(request)).await
    }
}
