# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every constant of the device code, with its unit, its reason and its source."""

import warp as wp

# --- guards

LEAST_DIVISOR = wp.constant(1.0e-30)
"""Lengths, their squares, and sums of weights count as at least this where they divide: nothing over nothing is then 0,
not NaN, and the inverse is within float32."""

LEAST_SINE = wp.constant(1.0e-12)
"""Sines of angles between unit vectors, and squares of sines and cosines, count as at least this where they divide:
what is smaller is rounding."""

# --- bounding volume hierarchy: layout

WIDTH = wp.constant(16)
"""Children of a node, and triangles of a leaf packet: the lanes of one AVX-512 register of float32, or of two of AVX.
A ray visits a third fewer nodes than with 8, and what it pays for is the wait for each."""

NODE_FLOATS = wp.constant(128)
"""float32 words of a node: 6 rows of 16 box planes, 16 child codes, 16 words of orders; eight cache lines."""

NODE_CHILDREN = wp.constant(96)
"""Word of a node at which its child codes begin."""

NODE_ORDERS = wp.constant(112)
"""Word of a node at which its orders of lanes begin: two words for each octant of directions."""

LEAF_FLOATS = wp.constant(160)
"""float32 words of a leaf packet: 9 rows of 16 vertex coordinates, 16 triangle ids; ten cache lines."""

LEAF_IDS = wp.constant(144)
"""Word of a leaf packet at which its triangle ids begin."""

LEAVE_INSTANCE = wp.constant(-(2**31))
"""Code on the traversal stack that stands for no child: here the ray leaves an instance and is the world's again."""

# --- groups of rays

GROUP = wp.constant(32)
"""Rays that go through the hierarchy together: the bits of a word. 16 and 64 measured within 5 % of it."""

LANE_COST = wp.constant(2)
"""Rays each against a whole packet that take as long as a triangle against all rays of a group: 13 ns beside 30."""

ALL_RAYS = wp.constant(wp.uint32(0xFFFFFFFF))
"""The set of all rays of a group."""

INVERSE_ROW = wp.constant(3)
FAR_ROW = wp.constant(6)
SHEAR_ROW = wp.constant(9)
AXES_ROW = wp.constant(12)
DIRECTION_ROW = wp.constant(15)

GROUP_FLOATS = wp.constant(588)
"""float32 words of a group: its rows of 32, then 12 bounds."""

SURFACE_FLOATS = wp.constant(544)
"""float32 words of the surface points that a group has met: 17 rows of 32, which group_surfaces.py has."""

LIT_FLOATS = wp.constant(832)
"""float32 words of how light reaches them: 26 rows of 32, which lit_surfaces.py has."""

GROUP_BOUNDS = wp.constant(576)
"""Word of a group at which its bounds begin."""

GROUP_FEW = wp.constant(16)
"""Rays of a group up to which each is tested against all boxes of a node, instead of each box against all rays; half of
GROUP or more, so that only one of a group's parts by octants needs bounds."""

GROUP_SPAN = wp.constant(1024)
"""Successive rays among which groups are formed, by octants of their directions: far more than there are rays in the
groups of 8 octants, few enough that neighbours stay together."""

RAY_LISTS = wp.constant(32)
"""Lists an octant that rays of a picture are put on before they are grouped, by the instance that they leave and the
light that they go to."""

TILE_PIXELS = wp.constant(512)
"""Pixels whose ray trees grow together: 256 measured 2 % slower, for groups are less full, 1024 and 2048 a tenth, for
their nodes leave the cache."""

CELL_WIDTH = wp.constant(8)
"""Width of the cells [pixel] by which pixels of a tile are numbered, so that those of a group are neighbours; so too
``CELL_HEIGHT``."""

CELL_HEIGHT = wp.constant(4)

TILE_NODES = wp.constant(8192)
"""Nodes that these trees have room for, 1.4 MB, of which no more is touched than there are: the mirror and the teapot
have some 1200."""

SHADOW_RAYS = wp.constant(2048)
"""Shadow rays that wait for each other."""

LAST_RAYS = wp.constant(2048)
"""Rays at the end of a worker's part that are taken in spans of LAST_SPAN, so that workers end together."""

LAST_SPAN = wp.constant(256)
"""Rays of such a span: a quarter of GROUP_SPAN, which makes groups less full."""

LAUNCH_SPANS = wp.constant(64)
"""Spans that a worker takes in one launch, some 30 ms at most: between launches an interrupt is heard."""

PROGRESS_WORDS = wp.constant(16)
"""Words that tell of a worker's progress, a cache line: first the first ray of its part that nobody has taken."""

END_WORD = wp.constant(1)
"""Where the part ends."""

BUSY_WORD = wp.constant(2)
"""Whether the worker may be in a launch."""

OVER_WORD = wp.constant(3)
"""Of the first worker's: whether all rays are taken."""

WAIT_TURNS = wp.constant(1 << 16)
"""How often the thread that asks a query looks whether the others are done before it goes to sleep: some 0.2 ms."""

YIELD_TURNS = wp.constant(1 << 13)
"""For how many of such turns the others stand back when they are: some 10 microseconds."""

FLIGHTS = wp.constant(12)
"""Rays that a thread keeps in flight where they have nothing in common: what it takes to hide the wait for memory."""

FLIGHT_FLOATS = wp.constant(1 << 22)
"""float32 words of a hierarchy, 16 MB, beyond which that pays: 0.95 times as fast at 4 MB, 1.7 times at 66 MB, where a
core has a cache of 2 MB to itself."""

RAY_CODE_BITS = wp.constant(8)
"""Bits a coordinate of the codes that scattered rays are sorted by. With 6 rays take 1 to 4 % longer."""

RAY_DIGIT_BITS = wp.constant(12)
"""Bits of a digit of those codes: half of a code."""

RAY_DIGITS = wp.constant(1 << 12)
"""Its values, counted in the first cache."""

SORT_STEPS = wp.constant(4)
"""Steps of the sort that a worker takes in one launch, some 40 ms at most: between launches an interrupt is heard."""

SCATTER_STRIDE = wp.constant(16)
"""One in so many pairs of successive rays tells whether they come in any order."""

SCATTERED = wp.constant(0.125)
"""Part of their origins' extent that successive rays are apart if they come in no order: 1/3 for points at random in a
box, 0.01 for 8 x 8 tiles of pixels."""

# --- bounding volume hierarchy: construction

SAH_BINS = wp.constant(32)
"""Bins an axis. 128 bins save another 0.3 % of node visits at four times the build time."""

SAH_BINS_SMALL = wp.constant(16)
"""Bins an axis for ranges of at most ``SAH_SMALL_COUNT`` references, where clearing bins would dominate."""

SAH_SMALL_COUNT = wp.constant(64)

CLUSTER_CELLS = wp.constant(32)
"""Cells an axis of the grid that clusters references: on a surface some 5000 are occupied."""

BUILD_STACK = wp.constant(64)
"""Pending ranges of a builder. It visits the smaller half first, so 2 + log2(2^31) entries are enough."""

REINSERTION_STACK = wp.constant(64)
"""Subtrees that a search for a better place has yet to look at, one a level. Where a tree is deeper below where the
search goes down, what lies deeper is not looked at: a better place there is missed, and the tree stays valid."""

REINSERTION_VISITS = wp.constant(64)
"""Nodes and ancestors that a search for a better place looks at; some twenty are the rule. What is farther away is not
looked at. SAH cost of lettering: -5.4 % with 64 and with 128, -4.4 % with 32."""

REINSERTION_GAIN = wp.constant(1.0e-6)
"""What a move has to save, as part of the largest area that its gain is reckoned from: less may be rounding, and moves
that only seem to pay never come to an end."""

MIN_EXTENT = wp.constant(1.0e-30)
"""Extent of doubled centroids along an axis up to which the axis cannot be split: its inverse must stay finite."""

INSTANCE_ROUNDING = wp.constant(2.0**-20 + 2.0**-24)
"""Relative growth of an instance's world box: 16 roundings (2^-24 each) of a ray's transform into its mesh, and one of
the box itself."""

PLOC_RADIUS = wp.constant(8)
"""Clusters on either side, in the order of Morton codes, among which one looks for the nearest. 4 costs 1 % more node
visits, 16 saves 1 % at best on even meshes and takes nearly twice the time."""

PLOC_NODE_WEIGHT = wp.constant(0.5)
"""What the areas of two nodes count beside that of the parent they may get. 0, which is the original's, costs 1 % more
visits, 0.8 up to 7 %, 1 up to 14 %."""

PLOC_AREA_MAX = wp.constant(1.0e38)
"""Areas beyond this, whose sums could leave float32, are alike."""

PACKET_REACH = wp.constant(1.5)
"""A packet's area by those of the clusters that it is joined from, at most. Without a limit packets are a twentieth
fuller and visits 4 % more; 1.25 wins nothing but packets."""

MORTON_BITS = wp.constant(21)
"""Bits an axis of a Morton code; three axes fill 63 bits."""

# --- intersection

MIN_DIRECTION = wp.constant(1.0e-30)
"""Components of a direction below this count as this in the box test. Its inverse is finite, and big enough that
a ray which runs parallel to a slab, inside by as little as one part in 1e17, leaves it beyond any scene."""

MAX_DIRECTION = wp.constant(1.0e30)
"""Components of a direction beyond this count as this in the box test: were an inverse flushed to zero, the infinite
planes of empty lanes would become NaN."""

BOX_PADDING = wp.constant(2.0**-23)
"""Growth of a node's boxes, in units of their largest coordinate or extent: at least one unit in the last place. A ray
along an axis that lies exactly in a box's upper plane would otherwise leave it where it enters, at 0 times the inverse
direction's 1e30, although the box's triangles reach that plane."""

SLAB_SCALE = wp.constant(1.0 + 4.0 * 2.0**-23)
"""Factor on a box's far distance that makes the slab test conservative: 1 + 2 gamma(3), rounded up. The factor goes
into the ray's inverse direction, once: that product is rounded as the one with the distance would be.

Reference: Ize (2013), Robust BVH Ray Traversal, JCGT 2(2), section 3.
"""

NO_TRIANGLE = wp.constant(-2)
"""Index of no triangle; an empty lane of a leaf packet has -1."""

WATERTIGHT = wp.constant(0)
"""``AccelData.intersector``: Woop, Benthin and Wald; WIDTH triangles at once."""

MOLLER_TRUMBORE = wp.constant(1)
"""``AccelData.intersector``: Moeller and Trumbore, triangle by triangle."""

PLANE_PROJECTION = wp.constant(2)
"""``AccelData.intersector``: the plane equation and the projection on a primary plane, triangle by triangle."""

# --- shapes

TRIANGLES = wp.constant(0)
"""Kind of a mesh's leaf packets; those of shapes have the numbers of ``scene.ShapeKind``."""

SPHERE = wp.constant(1)
FRUSTUM = wp.constant(2)
ROUND_CONE = wp.constant(3)
LINEAR_TUBE = wp.constant(4)
CUBIC_TUBE = wp.constant(5)

SHAPE_TEST = wp.constant(8)
"""What a shape's kind is added to where it stands beside ``AccelData.intersector``, whose numbers are below."""

SHAPE_LANES = wp.constant(4)
"""Shapes of a leaf packet: they are tested one after the other, so that more would cost more than another node."""

SHAPE_WORDS = wp.constant(10)
"""float32 words of a shape in a leaf packet."""

SHAPE_ID = wp.constant(9)
"""Word of those that holds its index."""

SHAPE_FLOATS = wp.constant(40)
"""float32 words of a leaf packet of shapes."""

PARAMETRIC = wp.constant(-1)
"""``PrimvarData.row_count`` of a primvar that is the shape's parametrisation."""

TUBE_WORDS = wp.constant(16)
"""float32 words of a piece of a cubic tube: four control points, each with its radius."""

TUBE_FLATNESS = wp.constant(0.0625)
"""Second difference of control points, by the radius, below which a piece of a tube counts as straight. The chord is
then off by less than 5 % of the radius, and t, which errs by the square, by less than 0.1 % of it."""

TUBE_STEPS = wp.constant(12)
"""Steps for u at most. Three of Newton's do, but where a ray runs along the tube and grazes it."""

TUBE_NEAR = wp.constant(2.0**-10)
"""Part of a straight piece of a tube below which a step for u ends the search: t errs by the square of it."""

TUBE_DEPTH = wp.constant(8)
"""Halvings of a tube's piece after which it counts as straight in any case: 2^-16 of the bend that it began with."""

# --- spawned rays

SPAWN_OFFSET = wp.constant(2.0**-19)
"""Offset of a spawned ray's origin, relative to the magnitudes that were rounded on the way to it and back: 32
roundings of 2^-24, where sums, transforms and the triangle test have about 20. 2^-22 passed every test too, 2^-26 did
not."""

SPAWN_OFFSET_MIN = wp.constant(2.0**-26)
"""Least offset, relative to the triangle's size: a ray straight up must not start on the plane z = 0 itself, where
there are no roundings to be bounded."""

GREAT_TRIANGLE = wp.constant(0.25)
"""Coordinates along a ray, by those of a triangle's corners, below which the ray gives the better hit point: rounding
errors go with them, and a factor of 4 pays for the plane's equation."""

RIM = wp.constant(2.0**-20)
"""Barycentric coordinate below which a point counts as lying at the triangle's rim: 16 roundings of 2^-24."""

PASS_LIMIT = wp.constant(32)
"""Surfaces, or parts of one, that a ray passes straight through: no bounces, with a limit of their own."""

SHADOW_LIMIT = wp.constant(4096)
"""Surfaces that a shadow ray crosses before it counts as blocked: a bound on the loop, beyond any real stage."""

# --- textures

SEAM = wp.constant(1.0e-5)
"""Distance beyond a UDIM tile, in tiles, and beyond the first in parts of its coordinate, at which a place still counts
as on its edge: interpolated coordinates are off by some units of their last bit."""

GRAZING = wp.constant(1.0e-6)
"""Cosine below which a ray counts as meeting a surface at this one, for its footprint: finite, and beyond any image."""

FOOTPRINT_MAX = wp.constant(1.0e9)
"""Width of a footprint [texel] that larger ones count as, and those that are no number: the coarsest level anyway."""

MAX_ANISOTROPY = wp.constant(16)
"""Probes along a footprint; one more than so many times as long as it is wide is averaged over too broad a strip. That
of graphics hardware: a ground plane is longer only within 4 degrees of the horizon."""

# --- materials

ROUGHNESS_MIN = wp.constant(0.001)
"""UsdPreviewSurface's lower bound of roughness (previewSurface.glslfx)."""

INPUT_MAX = wp.constant(2.0**60)
"""Largest size of an input: beyond all radiance there is, and its square, times the brightest light, is a float32."""

IOR_MIN = wp.constant(0.001)
"""Lower bound of the index of refraction in a reflectance, which has a pole at -1: there it is 0.996."""

MIRROR_FADE_START = wp.constant(0.1)
"""Roughness up to which a mirror ray carries the whole specular reflectance: the lobe is narrower than 2 degrees."""

MIRROR_FADE_END = wp.constant(0.4)
"""Roughness from which no mirror ray is sent: the lobe is wider than 20 degrees."""

ALBEDO_ROWS = wp.constant(17)
"""Roughnesses of the table of specular albedos, and"""

ALBEDO_COLUMNS = wp.constant(33)
"""cosines: interpolated, it is off by less than 0.001 where mirror rays do not carry the lobe."""

DIFFUSE_LOSS = wp.constant(0.028)
"""What Fresnel's factor takes of a diffuse layer seen edge-on, by F90 - F0: the mean of (1 - V.H)^5."""

GRAZING_FADE = wp.constant(50.0)
"""F90 is at most so many times F0: all of it from F0 = 0.02, an index of refraction of 1.33, on. What has an index of 1
reflects nothing at any angle. Reference: Lagarde and de Rousiers (2014), Moving Frostbite to PBR, section 3.2."""

JUST_SEEN = wp.constant(1.0e-3)
"""Least cosine of a bent normal to the viewer: above rounding, for lobes are sampled by it and divided by it."""

HORIZON = wp.constant(0.01)
"""Least cosine of a ray mirrored about a bent normal to the surface's own, just above the surface; half of the viewer's
where that is less."""

# --- lights

CYLINDER_FACETS = wp.constant(6)
"""Flat strips that stand for the lit half of a cylinder light: its irradiance is within 0.1 %."""

FAR_LIGHT = wp.constant(16.0)
"""Distance, in half diagonals, from which a rectangle is summed over 2 x 2 points: the rule's error is then 2e-6, that
of the exact sum's cancellation in float32 1e-5 and growing."""

GAUSS_POINT = wp.constant(0.5773502691896258)
"""1 / sqrt(3): the points of the two-point Gauss-Legendre rule on [-1, 1]."""

RIGHT_ANGLE = wp.constant(1.0e-3)
"""Cosine between the sides of a rect light up to which it is a rectangle: under a shear its area is sampled."""

SOLID_ANGLE_MIN = wp.constant(0.03)
"""Solid angle [sr] of a rectangle below which its area is sampled instead: a sum of four angles is off by 3e-7 in
float32, 1e-5 of this; and the densities of a sampled area differ little there."""

MESH_LIGHT_EXACT = wp.constant(64)
"""Triangles of a mesh light that are all summed exactly where it counts as a whole; of more, far clusters are not."""

CLUSTER_SIZE = wp.constant(1.0 / 16.0)
"""Radius, by its distance, below which a cluster of a mesh light's triangles counts as one patch: what
these send is within 0.5 %, at grazing angles 1 %."""

SHADOW_END = wp.constant(1.0 - 2.0**-13)
"""Part of the way to a sampled point of a light on which something can stand before it: a mesh that shows the lamp, in
the light's own surface, does not."""

SEEN_POINTS = wp.constant(192)
"""Points of a mesh light that are looked for past the rest of it, each for as much of what it sends: what parts of it
hide comes in steps of so much."""

LIGHT_CLEARANCE = wp.constant(2.0**-11)
"""Height above a mesh light at which a shadow ray to it ends where it counts as a whole, by the length of the ray: a
few times what rays start off a surface, which is 2^-19 of the coordinates."""

GLOSS_SHARE = wp.constant(0.5)
"""Part of a light's samples that goes where a surface mirrors the viewer, if it does nothing else."""

IMAGE_SHARE = wp.constant(0.5)
"""Part of the samples of a dome with an image that goes where it is bright; the rest goes by the cosine."""

OUTLINE_EDGES = wp.constant(32)
"""Edges of the polygon that stands for a circle where what a light sends is summed along its outline; even."""

OUTLINE_EDGES_FINE = wp.constant(64)
"""The same for a light that is shaped, of which a rim may leave no more than a sliver; even."""

WIDE_EDGE = wp.constant(0.1)
"""Squared sine of half the angle that an edge covers up to which a series of four terms holds, within 1e-6."""

DISK_CELLS = wp.constant(12)
"""Cells of chords that a disk is cut into where its solid angle is sampled."""

DISK_FAR = wp.constant(1.0)
"""Distance of a disk, by the diagonal of its half axes, from which its area is sampled: there the densities differ less
than chords would cost, which keep less of the order of samples than the map of the square to the disk."""

DISK_LOW = wp.constant(1.0e-3)
"""Height of a point above a disk's plane, likewise, below which it is: a tangent loses its digits."""

AIMED_END = wp.constant(1.57)
"""Angle to a light's axis up to which samples are aimed [rad]: short of 90 degrees, where the lobe's logarithm ends."""

AIMED_MESH_CONE = wp.constant(0.5)
"""Part of what is seen of a mesh light that its cone must take from it for samples to be aimed;"""

AIMED_MESH_FOCUS = wp.constant(0.65)
"""the same of a focus."""

AIMED_CONE = wp.constant(0.5)
"""The same of other lights, where that is a cone: all samples are aimed, for the sector holds all that is left."""

AIMED_FOCUS = wp.constant(0.97)
"""The same of other lights, where that is a focus, which is smooth: their own samples err less."""

AIMED_MOST = wp.constant(0.95)
"""Most of the samples of mesh lights and of a focus that are aimed: the others find what these miss."""

SERIES_END = wp.constant(0.05)
"""Number up to which five terms of the series of exp and log hold, within 1e-7."""

LIGHT_CELLS = wp.constant(8)
"""Cells each way that a light whose radiance varies is cut into where it counts as a whole; even."""

LIGHT_CELLS_FINE = wp.constant(16)
"""At least so many where the rim of a cone cuts through it, or where it has a texture or a profile."""

LIGHT_CELLS_MAX = wp.constant(72)
"""Most of them, where a narrow cone cuts through a light that looks large; 0.4 milliseconds."""

SLIVER_CELLS = wp.constant(8.0)
"""Cells across what a cone leaves of a light, at least: where it is less, more cells find it."""

CONE_CELLS = wp.constant(4.0)
"""Cells that the half angle of a cone is wide at least, where its rim cuts through the light."""

MERIDIAN_CELLS = wp.constant(512)
"""Rows from a light's axis to where its shaping ends: the last one is a 256th of that wide, the others less."""

FAR_END = wp.constant(4.0)
"""Pieces by which an edge may miss the far end of a light's axis and have finer ones near it."""

FAR_END_STEP = wp.constant(0.4)
"""Length of such a piece by its distance from there."""

CANCELLED = wp.constant(1.0e-4)
"""Part that is left of a sum along an outline below which its digits are too few, and cells are summed instead."""

ROUNDED = wp.constant(1.0e-6)
"""Part below which nothing is left of such a sum but rounding."""

MERIDIAN_STEPS = wp.constant(6.0)
"""Pieces of an outline by half the angle that a light covers, at least: the rim of a cone is met within one of them."""

OFF_AXIS = wp.constant(0.25)
"""Angle to a light's axis, by that of its cone, beyond which what is seen of it is summed from where it is dark. There
edges are near the end of that sum, where the azimuth changes the faster."""

FOCUS_STEP = wp.constant(1.2)
"""Longest piece of an edge by the angle in which a focused light falls to 1 / e: two-point rules are off by 0.1 %."""

WIDE_CHORD = wp.constant(0.25)
"""Half the chord of an edge above which its pieces are of the same angle, and not of the same length."""

POLE = wp.constant(1.0e-3)
"""Angle [rad] by which an IES profile may end before a pole and still reach it: files are rounded."""

FOCUS_CELLS = wp.constant(2.0)
"""Cells by the angle in which a focused light falls to 1 / e: the sum is then off by a 24th of the square of 1 / 2."""

STEEPEST = wp.constant(1.45)
"""Angle to the axis [rad] that wider ones count as there: the tangent has a pole beyond."""

FOCUS_DARK = wp.constant(1.0e-3)
"""Focus factor below which a light gets no more cells for the sake of it."""

FAR_PROFILE = wp.constant(0.15)
"""Half of the angle that a light with a profile covers, in cells of the profile, up to which it counts as if all of it
were where its light comes from in the mean."""

FAR_FOCUS = wp.constant(0.1)
"""The same for a focus, by the angle in which it falls to 1 / e: the mean over a rectangle is off by up to a sixth of
its square, 0.2 %."""

WIDE_PIECE = wp.constant(0.35)
"""Half angle [rad] beyond which a piece of a shaped mesh light's triangle is halved, whatever its radiance: what its
points send differs, by distance and cosines, too much for three of them to tell the mean radiance."""

SMALL_PIECE = wp.constant(0.1)
"""Radius, by its distance, up to which three points tell what a piece sends, too: the rule is exact for parabolas."""

FOCUS_PIECE = wp.constant(0.4)
"""Half angle of a piece, by the angle in which a focused light falls to 1 / e, for three points to tell its mean."""

HORIZON_PIECE = wp.constant(0.1)
"""The same of one that the horizon may cut: the points tell little of what is left."""

PROFILE_PIECE = wp.constant(0.5)
"""Half angle of a piece, in cells of the light's profile."""

RIM_PIECE = wp.constant(1.0 / 24.0)
"""Half angle of a piece that a cone's rim or a profile's end cuts, by that of the cone, of all of the light, or by how
far the cone reaches into it."""

SLIVER_PIECE = wp.constant(0.05)
"""Least of that reach, by the light's half angle: less is far darker than what is in the middle of the cone."""

SOFT_PIECE = wp.constant(0.125)
"""Half angle, by the width of a cone's soft rim, up to which pieces there are not halved."""

FINEST_PIECE = wp.constant(1.0 / 96.0)
"""Half angle, by that of all of the light, below which a profile halves no piece."""

PIECES_MAX = wp.constant(1 << 22)
"""Number from which pieces are not halved: those are 2^-22 of their triangle, under the surface itself."""

POINTS_ACROSS = wp.constant(8)
"""Most points along a side of a triangle of a mesh light, and most of a cluster, that are looked for past the rest."""

# --- programs

HASH_SEED = wp.constant(wp.uint32(0xDEADBEEF + 13))
"""Where the hash of noises begins, before four times the count of its numbers.

Reference: Jenkins (2006), lookup3.c, ``hashword``."""

UINT32_MAX = wp.constant(4294967295.0)
"""Largest word, as a number."""

NOISE_REACH = wp.constant(2.0e9)
"""Coordinate beyond which all cells of noises are one: below 2^31, the largest number that a cell can have."""

PERLIN_SCALE_2D = wp.constant(0.6616)
"""Brings sums of gradients of the plane about to -1..1; so too ``PERLIN_SCALE_3D``, of space.

Reference: MaterialX's reference library, mx_noise.glsl."""

PERLIN_SCALE_3D = wp.constant(0.9820)

REGISTERS = wp.constant(24)
"""Values that a program holds at a time, 16 bytes each, on the stack of its thread. A marble needs 4, three images that
are projected along the axes and mixed 8."""
