# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The structs that carry a scene into kernels; one field, one meaning."""

import warp as wp

mat34 = wp.types.matrix(shape=(3, 4), dtype=wp.float32)
"""Affine transform of column vectors: the linear part and the translation in column 3."""


@wp.struct
class MeshData:
    """Where the data of one mesh, or of one set of shapes, begin in the scene's shared arrays."""

    kind: wp.int32
    """TRIANGLES, or the kind of its shapes."""
    point_offset: wp.int32
    """First of its vertices in ``SceneData.points``, or of its control points in ``SceneData.controls``."""
    triangle_offset: wp.int32
    """First of its triangles in ``SceneData.corners``, whose entries are relative to ``point_offset``."""
    slot_offset: wp.int32
    """First of its material slots in ``SceneData.material_slots``; -1: slot 0 for every triangle."""
    face_offset: wp.int32
    """First of its face ids in ``SceneData.face_ids``; -1: a triangle's own index."""
    is_closed: wp.int32
    """1 where the surface bounds a volume."""
    outward: wp.float32
    """-1 where shapes are inside out, else 1: the factor of their outward normals."""


@wp.struct
class PrimvarData:
    """One primvar of one mesh, or of one set of shapes."""

    component_count: wp.int32
    """1 to 4; 0: the mesh has no such primvar."""
    value_offset: wp.int32
    """First component of row 0 in ``SceneData.primvar_values``."""
    corner_offset: wp.int32
    """First triangle's rows in ``SceneData.corners``; -1: constant, row 0. Of shapes always -1."""
    row_count: wp.int32
    """Of shapes: 1, 2 or 4 rows of Bernstein coefficients each, or PARAMETRIC; 0: constant."""


@wp.struct
class InstanceData:
    """One placed mesh."""

    world_from_local: mat34
    local_from_world: mat34
    """The two come first: ``group_surfaces.py`` reads them as 24 numbers."""
    mesh: wp.int32
    material_offset: wp.int32
    """First of its materials in ``SceneData.material_table``."""
    prim: wp.int32
    """primId."""
    id: wp.int32
    """instanceId or -1."""
    flags: wp.int32
    """Rays that it is there for: ``visibility.py``."""


@wp.struct
class ObjectSpace:
    """The space of a prim, where programs are computed, and that of its mesh, which unit shapes share."""

    object_from_mesh: mat34
    mesh_from_object: mat34


@wp.struct
class ImageData:
    """Texels of one image in the scene's shared arrays."""

    offset: wp.int32
    width: wp.int32
    height: wp.int32
    is_float: wp.int32
    """1: ``SceneData.texels_float``, 0: ``SceneData.texels_byte``."""
    is_srgb: wp.int32
    """1: red, green and blue are decoded by the sRGB curve."""
    level_count: wp.int32
    """Of an image: its levels, itself included, are the rows from here on; of those that follow it: 0."""


@wp.struct
class TextureData:
    """An image read through texture coordinates."""

    image: wp.int32
    """-1: the file was unreadable, the result is ``fallback``."""
    primvar: wp.int32
    """Primvar slot of the texture coordinates."""
    uv_fallback: wp.vec2
    row_u: wp.vec3
    """u' = dot(row_u, (u, v, 1))."""
    row_v: wp.vec3
    wrap_s: wp.int32
    wrap_t: wp.int32
    tiles: wp.int32
    """-1: one image; else the first entry of UDIM tiles in ``SceneData.tiles``, ``image`` being the grid of their
    means, and u' and v' count tiles from its lower left corner."""
    scale: wp.vec4
    bias: wp.vec4
    fallback: wp.vec4


@wp.struct
class InputData:
    """One input of a material that is a texture or a primvar."""

    texture: wp.int32
    """-1: a primvar."""
    primvar: wp.int32
    channel: wp.int32
    """0 to 3 picks one; -1 takes the vector."""
    scale: wp.vec4
    """Of a primvar: what is read is value * scale + bias."""
    bias: wp.vec4
    program: wp.int32
    """Row of ``SceneData.programs``, which then says all; -1: none."""


@wp.struct
class InstructionData:
    """One step of what is computed at a surface point: register ``out`` becomes what ``op`` makes of others."""

    op: wp.int32
    """As ``op_codes`` has them."""
    out: wp.int32
    a: wp.int32
    """Registers that it reads, as many as it needs; the others are 0."""
    b: wp.int32
    c: wp.int32
    size: wp.int32
    """Components that are computed."""
    data: wp.int32
    """Where it has any: row of ``SceneData.textures``, primvar slot, or kind of noise."""
    values: wp.int32
    """First of its constants in ``SceneData.program_values``."""


@wp.struct
class MaterialData:
    """What a material says apart from its inputs."""

    model: wp.int32
    use_specular_workflow: wp.int32
    opacity_mode: wp.int32
    opacity_threshold: wp.float32
    is_single_sided: wp.int32
    """Whether it is absent from behind."""
    has_normal_map: wp.int32
    """NORMAL_MAP, WORLD_NORMAL, or 0."""
    varying: wp.int32
    """A bit an input, the first one lowest: 1 where it is a texture or a primvar."""


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


@wp.struct
class SceneData:
    """Everything that shading reads, as one argument."""

    points: wp.array[wp.vec3]
    controls: wp.array[wp.vec4]
    """Control points of shapes, each with its radius."""
    corners: wp.array[wp.vec3i]
    """Vertex indices of triangles, and rows of primvars at triangle corners."""
    meshes: wp.array[MeshData]
    primvars: wp.array[PrimvarData]
    """Row-major [mesh, slot]; slot 0 holds the shading normals."""
    primvar_values: wp.array[wp.float32]
    primvar_count: wp.int32
    material_slots: wp.array[wp.int32]
    face_ids: wp.array[wp.int32]
    instances: wp.array[InstanceData]
    instance_primvars: wp.array2d[wp.vec4]
    """[slot, instance], NaN where there is none; no columns where no instance overrides a primvar."""
    has_hidden: wp.int32
    """1 where an instance is not there for rays of some kind."""
    material_table: wp.array[wp.int32]
    materials: wp.array[MaterialData]
    inputs: wp.array[InputData]
    """Row-major [material, input]; of constants they mean nothing."""
    input_values: wp.array[wp.vec4]
    """Row-major [material, input]: constants, their channel taken; what stands in for a primvar that is missing."""
    programs: wp.array[wp.vec2i]
    """Of each its first row of ``instructions``, and their number. What it computes is in register 0."""
    instructions: wp.array[InstructionData]
    program_values: wp.array[wp.vec4]
    origin: wp.vec3
    """World point that coordinates are relative to."""
    mesh_origins: wp.array[wp.vec3]
    """Points that the coordinates of meshes are relative to, in each one's own space; none without programs."""
    object_spaces: wp.array[ObjectSpace]
    """By ``InstanceData.prim``; none without programs."""
    textures: wp.array[TextureData]
    images: wp.array[ImageData]
    tiles: wp.array[wp.int32]
    """Images of UDIM tiles, grid by grid, row by row from the lower left: rows of ``images``, -1: no tile."""
    is_filtered: wp.int32
    """1: images have levels to choose from, so that rays carry differentials."""
    texels_byte: wp.array[wp.uint32]
    """RGBA, red in the lowest byte."""
    texels_float: wp.array[wp.vec4]
    srgb_decode: wp.array[wp.float32]
    """Linear value of each sRGB byte."""
    lights: wp.array[LightData]
    light_count: wp.int32
    links: wp.array[wp.uint32]
    """A bit an instance, the lowest first, for each set of instances that lights restrict themselves to."""
    shadows: wp.array[ShadowData]
    profiles: wp.array[ProfileData]
    light_textures: wp.array[LightTextureData]
    light_meshes: wp.array[LightMeshData]
    light_triangles: wp.array[LightTriangle]
    light_clusters: wp.array[LightCluster]
    profile_numbers: wp.array[wp.float32]
    meridians: wp.array[MeridianData]
    meridian_sums: wp.array[wp.vec4]
    domes: wp.array[DomeData]
    dome_count: wp.int32
    irradiance: wp.array[wp.vec3]
    albedo: wp.array[wp.vec2]
    """Table of what specular lobes reflect, for ``albedo.specular_albedo``."""
    dome_cells: wp.array[wp.float32]
    """Of each dome with an image cumulative brightness: of its rows, the lowest first, then of each row's columns."""
