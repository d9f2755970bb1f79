"""Encoder parameter files (EPF): how an animation is to be coded, plane by plane.

May use: parameters and the codec's settings.
"""
