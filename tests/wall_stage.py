# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A stage of a few lines, for tests of the command line."""

# A square that fills the middle half of the picture, 10 before an orthographic camera and moving away with time.
# (Apertures are in tenths of a scene unit: the camera sees 8 x 4.)
STAGE = """\
#usda 1.0
(
    defaultPrim = "World"
    upAxis = "Y"
    startTimeCode = 1
    endTimeCode = 3
)
def Xform "World"
{
    def Mesh "Wall" (prepend apiSchemas = ["MaterialBindingAPI"])
    {
        rel material:binding = </World/Blue>
        point3f[] points = [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        uniform token subdivisionScheme = "none"
        double3 xformOp:translate.timeSamples = { 1: (0, 0, -10), 3: (0, 0, -30) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Material "Blue"
    {
        token outputs:warp_rt:surface.connect = </World/Blue/Surface.outputs:surface>
        def Shader "Surface"
        {
            uniform token info:id = "WhittedSurface"
            color3f inputs:diffuse = (0.25, 0.5, 0.75)
            token outputs:surface
        }
    }
    def Camera "Front"
    {
        token projection = "orthographic"
        float horizontalAperture = 80
        float verticalAperture = 40
        float2 clippingRange = (0.1, 1000)
    }
    def DistantLight "Sun"
    {
        float inputs:intensity = 3.14159265
        float inputs:angle = 0
    }
}
"""
