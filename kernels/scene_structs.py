# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The structs that carry a scene into kernels; one field, one meaning."""

import warp as wp

from .light_structs import (
    DomeData,
    LightCluster,
    LightData,
    LightMeshData,
    LightTextureData,
    LightTriangle,
    MeridianData,
    ProfileData,
    ShadowData,
)

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
    caps: wp.int32
    """Which caps frusta have, as bits: 1 for the first, 2 for the last."""


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
    mag_filter: wp.int32
    """How the image is read between texels, where a sample sees less than one."""
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
    normal_frame: wp.int32
    """IMAGE_FRAME, PRIMVAR_FRAME, WORLD_FRAME; 0: no input bends the normal."""
    varying: wp.int32
    """A bit an input, the first one lowest: 1 where it is a texture or a primvar."""


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
