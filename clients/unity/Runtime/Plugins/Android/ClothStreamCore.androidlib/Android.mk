# SPDX-License-Identifier: MIT
# libclothstream_core.so: clothstream_core.cpp includes all sources. pack.mjs puts them into cpp.
LOCAL_PATH := $(call my-dir)
include $(CLEAR_VARS)
LOCAL_MODULE := clothstream_core
LOCAL_SRC_FILES := cpp/clothstream_core.cpp
LOCAL_C_INCLUDES := $(LOCAL_PATH)/cpp
# Contraction to fused operations would change bits, and the hashes of frames with them.
LOCAL_CPPFLAGS := -std=c++20 -O2 -DNDEBUG -ffp-contract=off -fno-rtti -fexceptions
LOCAL_LDFLAGS := -Wl,--version-script=$(LOCAL_PATH)/exported.map
include $(BUILD_SHARED_LIBRARY)
