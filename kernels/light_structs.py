# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The structs that carry lights into kernels, as rows of arrays of ``SceneData``; one field, one meaning."""

import warp as wp


@wp.struct
class LightData:
    """A light in world space."""

    kind: wp.int32
    position: wp.vec3
    axis_z: wp.vec3
    """Unit, world direction of local Z, which shaping looks at; a distant light shines along -axis_z."""
    normal: wp.vec3
    """Rect and disk: unit, of their plane, which shear turns away from local Z. They shine along -normal."""
    emission: wp.vec3
    """Distant, and point without fall-off: the irradiance of a facing surface. Else: its surface's radiance."""
    radius: wp.float32
    half_x: wp.vec3
    """Half axes of the shape as its transform leaves them, world space; so too ``half_y``."""
    half_y: wp.vec3
    half_z: wp.vec3
    cap: wp.float32
    """Distant: 1 - cos of half its angle."""
    varies: wp.int32
    """UNEVEN where its shape is not what its radius says, VARIED where its radiance is not the same from all points in
    all directions, both or neither."""
    has_falloff: wp.int32
    casts_shadow: wp.int32
    diffuse: wp.float32
    specular: wp.float32
    focus: wp.float32
    focus_tint: wp.vec3
    cone_angle: wp.float32
    """Half angle [rad]; pi or more: no cone."""
    cone_softness: wp.float32
    receivers: wp.int32
    """Its first word in ``SceneData.links``, whose bits tell the instances that it illuminates; -1: all of them."""
    shadow: wp.int32
    """Row of ``SceneData.shadows``; -1: black shadows of everything, at any distance."""
    profile: wp.int32
    """Row of ``SceneData.profiles``; -1: none."""
    meridians: wp.int32
    """Row of ``SceneData.meridians``; -1: none."""
    texture: wp.int32
    """Row of ``SceneData.light_textures``, whose mean is part of ``emission``; -1: none."""
    mesh: wp.int32
    """Row of ``SceneData.light_meshes``; -1: none."""
    glows: wp.int32
    """1 for a mesh light whose mesh emits by its material, which mirror rays bring back."""
    is_visible: wp.int32
    """0: eye rays do not meet its shape, where others do."""


@wp.struct
class ShadowData:
    """Shadows that are not merely the absence of a light."""

    color: wp.vec3
    """What is left of the light where nothing of it arrives."""
    distance: wp.float32
    """From the surface, beyond which nothing casts a shadow."""
    falloff: wp.float32
    """Length at the end of ``distance`` over which shadows fade."""
    falloff_gamma: wp.float32
    casters: wp.int32
    """First word in ``SceneData.links``, whose bits tell the instances that cast shadows; -1: all of them."""


@wp.struct
class LightTextureData:
    """The texture of a rect light."""

    image: wp.int32
    radiance: wp.vec3
    """Factor of its texels."""


@wp.struct
class LightMeshData:
    """The triangles of a mesh light."""

    offset: wp.int32
    """First of them in ``SceneData.light_triangles``."""
    count: wp.int32
    area: wp.float32
    """Of all of them, world space."""
    is_double_sided: wp.int32
    """1: it shines to both sides, 0: outwards."""
    is_closed: wp.int32
    """1: it bounds a volume."""
    leaves: wp.int32
    """``count`` rounded up to a power of two."""
    clusters: wp.int32
    """Where its heap begins in ``SceneData.light_clusters``: rows 1 (all of it) to ``leaves`` - 1, row k holding what
    rows 2 k and 2 k + 1 hold; rows from ``leaves`` on are triangles."""
    ball_bits: wp.int32
    """Of a light that consists of balls: each has 2^``ball_bits`` leaves of its own."""


@wp.struct
class LightCluster:
    """Triangles of a mesh light that lie near to one another."""

    center: wp.vec3
    """Their centre of area, world space."""
    radius: wp.float32
    """Of the ball about it that holds them."""
    area: wp.vec3
    """Sum of their normals, each as long as its triangle is large."""
    size: wp.float32
    """Sum of their areas."""
    moment: wp.mat33
    """Sum of the outer products of those and their triangles' middles, from the centre: 0 where all lie in a plane."""
    cos_spread: wp.float32
    """Cosine of the largest angle between that and a triangle's normal; 2: it is empty."""
    middle: wp.int32
    """One of them, of the light's."""
    free_sides: wp.int32
    """Bits that all of them have in ``LightTriangle.free_sides``."""
    body: wp.int32
    """Convex body whose outside all of them are; -1: of none, or of several."""
    balls: wp.int32
    """1: they are all that stand for one ball; 2: for several; 0: for none."""


@wp.struct
class LightTriangle:
    """One of them, world space, wound as seen from outside. They lie along a Morton curve: neighbours are near."""

    origin: wp.vec3
    side_x: wp.vec3
    """From the origin to the second corner; so too ``side_y``, to the third."""
    side_y: wp.vec3
    free_sides: wp.int32
    """Sides from which nothing that is drawn of the light can be before it: 1 the outside, 2 the inside, 3 both."""
    body: wp.int32
    """Convex body of which it is a part of the outside; -1: of none."""


@wp.struct
class ProfileData:
    """An IES profile as one light has it: numbers over vertical and horizontal angles."""

    offset: wp.int32
    """First of its numbers in ``SceneData.profile_numbers``: vertical angles [rad], ascending, then horizontal ones,
    then the factors for the first of these, for the second, ..."""
    vertical_count: wp.int32
    horizontal_count: wp.int32
    angle_scale: wp.float32
    """UsdLux's ``shaping:ies:angleScale``."""
    first_end: wp.float32
    """Angle to the light's axis [rad] at which its vertical angles begin; a far negative one where that is a pole."""
    last_end: wp.float32
    """At which they end, likewise."""
    vertical_cell: wp.float32
    """Change of the angle to the light's axis [rad] within which the profile is nearly a straight line."""
    horizontal_cell: wp.float32
    """The same for the angle about the axis."""
    row_x: wp.vec3
    """Rows of the matrix from world space to the light's, up to one factor for all; so too ``row_y`` and ``row_z``."""
    row_y: wp.vec3
    row_z: wp.vec3


@wp.struct
class MeridianData:
    """Sums of a light's focus, cone and profile from its axis to each angle, for ``kernels.meridian``.

    Each number is F1 and F2 and their derivatives, at an angle that grows with the square of its row. They are those of
    each plane of the profile, from the axis, then from its other end; then, where ``has_open``, the same without the
    focus.
    """

    offset: wp.int32
    """First of them in ``SceneData.meridian_sums``."""
    planes: wp.int32
    has_open: wp.int32
    begin: wp.float32
    """Angle to the axis [rad] of the first row, up to which the light sends nothing."""
    end: wp.float32
    """Of the last row, from which on it sends nothing. From the axis's other end the two change places."""
    step: wp.float32
    """Angle [rad] over which they are smooth."""


@wp.struct
class DomeData:
    """Light from infinity."""

    axis_x: wp.vec3
    """World directions of the dome's local axes."""
    axis_y: wp.vec3
    axis_z: wp.vec3
    radiance: wp.vec3
    image: wp.int32
    is_visible: wp.int32
    irradiance_offset: wp.int32
    """First entry of its irradiance map in ``SceneData.irradiance``; -1: constant, pi * radiance."""
    cells_offset: wp.int32
    """First entry of its distribution in ``SceneData.dome_cells``; -1: constant."""
    cell_rows: wp.int32
    cell_columns: wp.int32
    diffuse: wp.float32
    specular: wp.float32
    receivers: wp.int32
    """As in ``LightData``; so too ``casts_shadow`` and ``shadow``."""
    casts_shadow: wp.int32
    shadow: wp.int32
