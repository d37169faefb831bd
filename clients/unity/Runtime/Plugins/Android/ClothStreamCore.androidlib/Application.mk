# SPDX-License-Identifier: MIT
APP_STL := c++_static
APP_OPTIM := release
# Pages of 16 KiB, as Android 15 may have.
APP_SUPPORT_FLEXIBLE_PAGE_SIZES := true
