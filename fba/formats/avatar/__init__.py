"""Avatar animation units (ISO/IEC 23090-39): faces as ARKit's weights, bodies as matrices of joints.

May use: carriage, capture, face, body.
"""
