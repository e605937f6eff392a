//! What touches what, what rays hit, and what surfaces are like.

use simd_proto::v1::{
    CastRaysRequest, CastShapeRequest, ClosestPoints, Contact, FindOverlapsRequest, GetClosestPointsRequest,
    GetCollisionFilterRequest, GetCollisionFilterResponse, GetContactsRequest, GetLinkBoundsRequest,
    GetLinkPropertiesRequest, LinkBounds, LinkName, LinkProperties, Ray, RayHit, SetCollisionFilterRequest,
    SetLinkPropertiesRequest, Stamp, Vector3,
};

use crate::{Client, Error, client::present};

/// A straight line between two points of the world, metres.
pub fn ray(from: [f64; 3], to: [f64; 3]) -> Ray {
    let point = |[x, y, z]: [f64; 3]| Some(Vector3 { x, y, z });
    Ray { from: point(from), to: point(to) }
}

/// `ContactService`, and what surfaces are like.
impl Client {
    /// The points at which links of a robot touch others; of all robots where none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn contacts(&self, robot: Option<&str>) -> Result<Vec<Contact>, Error> {
        let request = GetContactsRequest { robot: robot.unwrap_or_default().to_owned() };
        Ok(self.unary(self.contact().get_contacts(request)).await?.contacts)
    }

    /// What each ray meets first, in the order of the rays.
    ///
    /// # Errors
    /// `LIMIT_EXCEEDED` beyond 20,000 rays, `INVALID_VALUE`.
    pub async fn cast_rays(&self, rays: impl IntoIterator<Item = Ray>) -> Result<Vec<RayHit>, Error> {
        self.cast_rays_in_groups(rays, None).await
    }

    /// The same of links that are in one of the groups of `collision_mask`, a bit each; of all where it is `None`.
    /// Rays pass what is in none of them.
    ///
    /// # Errors
    /// Those of [`Client::cast_rays`].
    pub async fn cast_rays_in_groups(
        &self,
        rays: impl IntoIterator<Item = Ray>,
        collision_mask: Option<u32>,
    ) -> Result<Vec<RayHit>, Error> {
        let request = CastRaysRequest { rays: rays.into_iter().collect(), collision_mask };
        Ok(self.unary(self.contact().cast_rays(request)).await?.hits)
    }

    /// How far links are apart, and where they are nearest.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn closest_points(
        &self,
        request: GetClosestPointsRequest,
    ) -> Result<Vec<ClosestPoints>, Error> {
        Ok(self.unary(self.contact().get_closest_points(request)).await?.pairs)
    }

    /// The links that a shape overlaps.
    ///
    /// # Errors
    /// `INVALID_VALUE`.
    pub async fn overlaps(&self, request: FindOverlapsRequest) -> Result<Vec<LinkName>, Error> {
        Ok(self.unary(self.contact().find_overlaps(request)).await?.links)
    }

    /// What a shape meets first on a straight way.
    ///
    /// # Errors
    /// `INVALID_VALUE`.
    pub async fn cast_shape(&self, request: CastShapeRequest) -> Result<RayHit, Error> {
        present(self.unary(self.contact().cast_shape(request)).await?.hit, "hit")
    }

    /// The boxes around the links of robots, along the world's axes; of all robots where none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn link_bounds(&self, robots: &[&str]) -> Result<Vec<LinkBounds>, Error> {
        let robots = robots.iter().map(|robot| (*robot).to_owned()).collect();
        Ok(self.unary(self.contact().get_link_bounds(GetLinkBoundsRequest { robots })).await?.links)
    }

    /// How the surfaces of a robot's links rub and bounce.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn link_properties(&self, robot: &str) -> Result<Vec<LinkProperties>, Error> {
        let request = GetLinkPropertiesRequest { robot: robot.to_owned() };
        Ok(self.unary(self.entity().get_link_properties(request)).await?.links)
    }

    /// Changes the surfaces of links; an empty name means all.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn set_link_properties(
        &self,
        robot: &str,
        links: impl IntoIterator<Item = LinkProperties>,
    ) -> Result<Stamp, Error> {
        let links = links.into_iter().collect();
        let request = SetLinkPropertiesRequest { robot: robot.to_owned(), links, ..Default::default() };
        present(self.unary(self.entity().set_link_properties(self.claimed(request))).await?.stamp, "stamp")
    }

    /// What a robot touches: itself or not, and which pairs of links are switched off or on.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn collision_filter(&self, robot: &str) -> Result<GetCollisionFilterResponse, Error> {
        let request = GetCollisionFilterRequest { robot: robot.to_owned() };
        self.unary(self.entity().get_collision_filter(request)).await
    }

    /// Changes that.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn set_collision_filter(&self, request: SetCollisionFilterRequest) -> Result<Stamp, Error> {
        present(self.unary(self.entity().set_collision_filter(self.claimed(request))).await?.stamp, "stamp")
    }
}
