# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What ``InstructionData.op`` stands for; ``warp_rt.scene.programs.Op`` has the same names, and says what each does."""

import warp as wp

# --- of the surface point

OP_POSITION = wp.constant(0)
OP_POSITION_WORLD = wp.constant(1)
OP_NORMAL_WORLD = wp.constant(2)
OP_TANGENT_WORLD = wp.constant(3)
OP_VIEW_WORLD = wp.constant(4)
OP_POSITION_ACROSS = wp.constant(5)
OP_POSITION_DOWN = wp.constant(6)
OP_GROWTH_S = wp.constant(7)
OP_GROWTH_T = wp.constant(8)
OP_PRIMVAR = wp.constant(9)
OP_TEXTURE = wp.constant(10)
OP_TEXTURE_AT = wp.constant(11)

# --- from one space to another

OP_POINT_TO_WORLD = wp.constant(12)
OP_POINT_TO_OBJECT = wp.constant(13)
OP_VECTOR_TO_WORLD = wp.constant(14)
OP_VECTOR_TO_OBJECT = wp.constant(15)
OP_NORMAL_TO_WORLD = wp.constant(16)
OP_NORMAL_TO_OBJECT = wp.constant(17)

# --- of all components together

OP_AFFINE = wp.constant(18)
OP_UNIT = wp.constant(19)
OP_LENGTH = wp.constant(20)
OP_CROSS = wp.constant(21)
OP_PERLIN_2D = wp.constant(22)
OP_PERLIN_3D = wp.constant(23)
OP_CELLS_2D = wp.constant(24)
OP_CELLS_3D = wp.constant(25)
OP_WORLEY_2D = wp.constant(26)
OP_WORLEY_3D = wp.constant(27)
OP_WORLEY_CELLS_2D = wp.constant(28)
OP_WORLEY_CELLS_3D = wp.constant(29)

# --- component by component: all from here on

OP_MULTIPLY = wp.constant(30)
OP_RECIPROCAL = wp.constant(31)
OP_CLIP = wp.constant(32)
OP_CHOOSE = wp.constant(33)
OP_GREATER = wp.constant(34)
OP_GREATER_EQUAL = wp.constant(35)
OP_EQUAL = wp.constant(36)
OP_MINIMUM = wp.constant(37)
OP_MAXIMUM = wp.constant(38)
OP_POWER = wp.constant(39)
OP_MODULO = wp.constant(40)
OP_ARCTAN2 = wp.constant(41)
OP_ABSOLUTE = wp.constant(42)
OP_SIGN = wp.constant(43)
OP_FLOOR = wp.constant(44)
OP_CEIL = wp.constant(45)
OP_SQRT = wp.constant(46)
OP_EXP = wp.constant(47)
OP_EXP2 = wp.constant(48)
OP_LOG = wp.constant(49)
OP_SIN = wp.constant(50)
OP_COS = wp.constant(51)
OP_TAN = wp.constant(52)
OP_ARCSIN = wp.constant(53)
OP_ARCCOS = wp.constant(54)
