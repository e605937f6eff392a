//! Contacts, ray casts, distances, and surfaces of links.

use simd_proto::v1::{
    CastRaysRequest, CastShapeRequest, ClosestPoints, Contact, FindOverlapsRequest, GetClosestPointsRequest,
    GetCollisionFilterRequest, GetCollisionFilterResponse, GetContactsRequest, GetLinkBoundsRequest,
    GetLinkPropertiesRequest, LinkBounds, LinkName, LinkProperties, Ray, RayHit, SetCollisionFilterRequest,
    SetLinkPropertiesRequest, Stamp, Vector3,
};

use crate::{Client, Error, client::present};

/// Makes a ray: a straight line between two points of the world, metres.
pub fn ray(from: [f64; 3], to: [f64; 3]) -> Ray {
    let point = |[x, y, z]: [f64; 3]| Some(Vector3 { x, y, z });
    Ray { from: point(from), to: point(to) }
}

/// `ContactService`, and the calls for surfaces and collision filters.
impl Client {
    /// Returns the points at which links of a robot touch others; of all robots if none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn contacts(&self, robot: Option<&str>) -> Result<Vec<Contact>, Error> {
        let request = GetContactsRequest { robot: robot.unwrap_or_default().to_owned() };
        Ok(self.unary(self.contact().get_contacts(request)).await?.contacts)
    }

    /// Returns the first hit of each ray, in the order of the rays.
    ///
    /// # Errors
    /// `LIMIT_EXCEEDED` above 20,000 rays, `INVALID_VALUE`.
    pub async fn cast_rays(&self, rays: impl IntoIterator<Item = Ray>) -> Result<Vec<RayHit>, Error> {
        self.cast_rays_in_groups(rays, None).await
    }

    /// Like [`Client::cast_rays`], for links in one of the groups of `collision_mask`, a bit each; `None` is
    /// all links. Rays pass through other links.
    ///
    /// # Errors
    /// As [`Client::cast_rays`].
    pub async fn cast_rays_in_groups(
        &self,
        rays: impl IntoIterator<Item = Ray>,
        collision_mask: Option<u32>,
    ) -> Result<Vec<RayHit>, Error> {
        let request = CastRaysRequest { rays: rays.into_iter().collect(), collision_mask };
        Ok(self.unary(self.contact().cast_rays(request)).await?.hits)
    }

    /// Returns distances between links, and their nearest points.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn closest_points(
        &self,
        request: GetClosestPointsRequest,
    ) -> Result<Vec<ClosestPoints>, Error> {
        Ok(self.unary(self.contact().get_closest_points(request)).await?.pairs)
    }

    /// Returns the links that a shape overlaps.
    ///
    /// # Errors
    /// `INVALID_VALUE`.
    pub async fn overlaps(&self, request: FindOverlapsRequest) -> Result<Vec<LinkName>, Error> {
        Ok(self.unary(self.contact().find_overlaps(request)).await?.links)
    }

    /// Returns the first hit of a shape that moves in a straight line.
    ///
    /// # Errors
    /// `INVALID_VALUE`.
    pub async fn cast_shape(&self, request: CastShapeRequest) -> Result<RayHit, Error> {
        present(self.unary(self.contact().cast_shape(request)).await?.hit, "hit")
    }

    /// Returns the boxes around the links of robots, along the world's axes; of all robots if none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn link_bounds(&self, robots: &[&str]) -> Result<Vec<LinkBounds>, Error> {
        let robots = robots.iter().map(|robot| (*robot).to_owned()).collect();
        Ok(self.unary(self.contact().get_link_bounds(GetLinkBoundsRequest { robots })).await?.links)
    }

    /// Returns friction, restitution and collision groups of a robot's links.
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

    /// Whether a robot stays awake, even if the world lets bodies sleep.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn stays_awake(&self, robot: &str) -> Result<bool, Error> {
        let request = GetLinkPropertiesRequest { robot: robot.to_owned() };
        Ok(self.unary(self.entity().get_link_properties(request)).await?.stays_awake)
    }

    /// Changes that, and wakes the robot.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn set_stays_awake(&self, robot: &str, stays_awake: bool) -> Result<Stamp, Error> {
        let request = SetLinkPropertiesRequest {
            robot: robot.to_owned(),
            stays_awake: Some(stays_awake),
            ..Default::default()
        };
        present(self.unary(self.entity().set_link_properties(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Returns the collision filter of a robot: self-collision, and the pairs of links that are switched off or on.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn collision_filter(&self, robot: &str) -> Result<GetCollisionFilterResponse, Error> {
        let request = GetCollisionFilterRequest { robot: robot.to_owned() };
        self.unary(self.entity().get_collision_filter(request)).await
    }

    /// Changes the collision filter of a robot.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn set_collision_filter(&self, request: SetCollisionFilterRequest) -> Result<Stamp, Error> {
        present(self.unary(self.entity().set_collision_filter(self.claimed(request))).await?.stamp, "stamp")
    }
}
