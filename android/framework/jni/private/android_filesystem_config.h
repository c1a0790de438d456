#pragma once
#define AID_SYSTEM 1000
