/* The messages of psr/client.h as structs. proto/PROTOCOL.md describes their meaning and their bytes. Coordinates and
 * lengths have a magnitude of at most 1e30, positive lengths at least 1e-30. */
#ifndef PSR_MESSAGE_H
#define PSR_MESSAGE_H

#include <stdint.h>
#include "psr/frame.h"
#include "psr/view.h"

#ifdef __cplusplus
extern "C" {
#endif

#define PSR_WIRE_MAX_NAME 255          /* bytes of UTF-8 */
#define PSR_WIRE_MAX_SIDE 16384        /* pixels */
#define PSR_WIRE_MAX_LEVELS 31         /* of an octree */
#define PSR_WIRE_MAX_PIXELS 67108864u  /* 64 Mpixel */
#define PSR_WIRE_MAX_INSTANCES 1024
#define PSR_WIRE_MAX_LIGHTS 32
#define PSR_WIRE_MAX_SCENES 16         /* slots 0..15 */
#define PSR_WIRE_MAX_PASS 4           /* of settings */
#define PSR_WIRE_MAX_OPEN 64           /* open ids of view 0 */
#define PSR_WIRE_MAX_REPORT 64
#define PSR_WIRE_MAX_STATS 64
#define PSR_WIRE_MAX_LENGTH 1e30       /* magnitude of a coordinate or length; positive lengths are at least 1e-30 */
#define PSR_WIRE_MAX_INTENSITY 1e6

/* Features that a server offers (WELCOME); clients ignore unknown bits. Every server offers view 0, colour as raw, JPEG or zstd,
 * depth as float, raw or zstd, blocks, lights without shadows. */
enum psr_cap {
	PSR_CAP_VIEWS = 1 << 0,        /* views > 0: supersession, window of unacknowledged frames, ACK */
	PSR_CAP_REFINE = 1 << 1,       /* pass_limit > 0 */
	PSR_CAP_BASE = 1 << 2,         /* frames as changes to a base */
	PSR_CAP_TIME_BUDGET = 1 << 3,
	PSR_CAP_ERROR_BOUND = 1 << 4,
	PSR_CAP_SETTINGS = 1 << 5,     /* settings of a scale other than 1 */
	PSR_CAP_SHADOWS = 1 << 6,
	PSR_CAP_DEPTH_U16 = 1 << 7,    /* depth formats U16 and U16_HALF, in the range that FRAME gives */
	PSR_CAP_NORMAL = 1 << 8,
	PSR_CAP_ID = 1 << 9,
	PSR_CAP_WEIGHT = 1 << 10,
	PSR_CAP_WORDS = 1 << 11,
	PSR_CAP_PNG = 1 << 12,
	PSR_CAP_OCTREE = 1 << 13,
	PSR_CAP_DPOINT = 1 << 14,
	PSR_CAP_APPEND = 1 << 15,      /* SCENE with PSR_WIRE_SCENE_APPEND */
	PSR_CAP_BUILD = 1 << 16,       /* OPEN builds source files */
	PSR_CAP_FETCH = 1 << 17,       /* parts of model files */
	PSR_CAP_PAUSE = 1 << 18,
	PSR_CAP_PRESETS = 1 << 19,
	PSR_CAP_RESOLUTION = 1 << 21,  /* OPEN tells the size of the pictures */
	PSR_CAP_BLOCK = 1 << 20,
	PSR_CAP_SHARP = 1 << 22,       /* FRAME with PSR_WIRE_FRAME_SHARP; needs VIEWS */
	PSR_CAP_RMSE_BOUND = 1 << 23,
	PSR_CAP_BOUND = 1 << 24,       /* the plane of bounds */
	PSR_CAP_LEVELS = 1 << 25,      /* OPEN of the first levels of a packed octree */
	PSR_CAP_COLOR_BY = 1 << 26,    /* instances in other colours than their own */
	PSR_CAP_FINE = 1 << 28,        /* settings of smooth 2 */
	PSR_CAP_SPLATS = 1 << 29,      /* settings of splats 1 */
};

/* ---- the session ---- */

struct psr_msg_welcome { /* server -> client, answers HELLO; id 0 */
	uint16_t major, minor;
	uint64_t capabilities;
	uint32_t max_message;    /* longest message that the server takes, 1024..65536; it sends up to 65536 */
	uint32_t max_side;       /* the limits from here on are the server's own, at least 1, at most those of this
	                          * header */
	uint32_t max_pixels;
	uint32_t max_instances;
	uint32_t max_lights;
	uint32_t max_scenes;
	uint32_t max_open;
	uint32_t max_models;     /* open handles of a connection */
	uint32_t idle_timeout_ms; /* the server closes a connection that sends no byte for this long; 0: never */
	char server[PSR_WIRE_MAX_NAME + 1]; /* name and version */
};

/* ---- models ---- */

enum psr_entry_state {
	PSR_ENTRY_READY = 1,   /* a model file */
	PSR_ENTRY_LOADED = 2,  /* the same, in the server's memory now */
	PSR_ENTRY_SOURCE = 3,  /* a source file: OPEN builds it first */
	PSR_ENTRY_FAILED = 4,  /* the server could not build or read it; OPEN says why */
};
struct psr_msg_list_entry { /* one a model, sorted by the names' bytes */
	uint8_t state;          /* the decoder turns an unknown one into FAILED */
	uint64_t file_bytes;
	uint8_t content_id[16]; /* zero if not known yet */
	char name[PSR_WIRE_MAX_NAME + 1];
};

enum psr_progress_stage {
	PSR_PROGRESS_WAITING = 0, PSR_PROGRESS_IMPORT = 1, PSR_PROGRESS_SAMPLE = 2, PSR_PROGRESS_SELECT = 3,
	PSR_PROGRESS_WRITE = 4, PSR_PROGRESS_LOAD = 5,
};
struct psr_msg_progress { /* any number of these before OPENED; stages never go back */
	uint16_t stage;       /* the decoder turns an unknown one into LOAD */
	uint64_t done, total; /* in units of the stage; total 0: unknown, and done only rises; else done <= total */
};

enum psr_wire_color {
	PSR_WIRE_COLOR_OWN = 0, PSR_WIRE_COLOR_INTENSITY = 1, PSR_WIRE_COLOR_CLASS = 2, PSR_WIRE_COLOR_HEIGHT = 3,
	PSR_WIRE_COLOR_RETURN = 4,
};
enum psr_wire_rep { PSR_WIRE_REP_AUTO = 0, PSR_WIRE_REP_BLOCKS = 1, PSR_WIRE_REP_OCTREE = 2, PSR_WIRE_REP_DPOINT = 3 };
struct psr_msg_opened {
	uint32_t handle;          /* not 0; of this connection */
	uint8_t representations;  /* bit r: the model has representation r of enum psr_wire_rep; not 0, bit 0 is 0;
	                           * receivers ignore unknown bits */
	uint8_t colors;           /* bit c: it can be painted by c of enum psr_wire_color, as it is drawn where nobody
	                           * names a representation; bit 0 is 0; all 0: the server does not tell; unknown bits as
	                           * above */
	uint8_t octree_levels, of_levels; /* of a beginning: levels of its octree, and of the whole file's; else both 0 */
	uint8_t content_id[16];
	double box_min[3], box_max[3]; /* around the samples, in object coordinates (those of the source file) */
	double origin[3];
	double scale;             /* object units an inner unit; > 0 */
	double spacing;           /* of samples at the finest level, object units; > 0 */
	uint32_t resolution;      /* target resolution: pixels across the unit sphere at magnification 1; >= 1 */
	uint32_t n_levels;        /* >= 1 */
	uint64_t n_samples, n_blocks, bytes; /* bytes: in the server's memory */
	double up[3];             /* the model's natural way up, object coordinates; | |up|^2 - 1 | <= 1e-6 */
};

/* Parts of the file of a model, as it is on the server's disk. */
struct psr_msg_fetch { /* client -> server */
	uint32_t handle;          /* of an open model; 0: of the model file of this name, which need not be open */
	uint64_t offset, length;  /* of the part, bytes; what lies behind the file's end is left out; length 0: up to there */
	uint64_t file_hash;       /* of the file that the client has a part of, or 0: any */
	char name[PSR_WIRE_MAX_NAME + 1]; /* "" with a handle */
};
struct psr_msg_fetch_part { /* server -> client; in the order of the file, without gaps */
	uint64_t offset;
	uint32_t bytes;           /* >= 1 */
	const uint8_t *data;      /* encode: the caller's; decode: within the payload */
};
struct psr_msg_fetch_end { /* server -> client, when all has been sent */
	uint64_t file_bytes, file_hash; /* file_hash: the 8 bytes at 56 of the file, which stand for all of it */
};

/* ---- scenes ---- */

struct psr_msg_instance { /* world = translation + scale * rotate(rotation, object) */
	uint32_t handle;
	uint8_t representation;   /* enum psr_wire_rep */
	uint8_t color_by;         /* enum psr_wire_color */
	double rotation[4];       /* x, y, z, w; | |q|^2 - 1 | <= 1e-6; receivers normalise it */
	double translation[3];
	double scale;             /* 1e-30..1e30 */
};

enum psr_wire_light_kind { PSR_WIRE_LIGHT_DIRECTIONAL = 1, PSR_WIRE_LIGHT_POINT = 2, PSR_WIRE_LIGHT_SPOT = 3 };
enum psr_wire_light_flag { PSR_WIRE_LIGHT_SHADOW = 1 };
struct psr_msg_light { /* a field that the kind does not use is 0 */
	uint8_t kind;
	uint8_t flags;
	uint8_t color[3];         /* sRGB */
	double intensity;         /* 0..1e6, multiplies the linear colour */
	double position[3];       /* point, spot: world */
	double direction[3];      /* directional, spot: the way the light travels, away from it; length >= 1e-30 */
	double inner, outer;      /* spot: half angles, radians, 0 <= inner <= outer, 1e-6 <= outer <= pi: full
	                           * inside of inner, none outside of outer */
	double reference;         /* point, spot: distance at which intensity holds, falling with the square; 0: it does
	                           * not fall */
};

/* APPEND adds to the slot instead of replacing its scene (PSR_CAP_APPEND). */
enum psr_wire_scene_flag { PSR_WIRE_SCENE_APPEND = 1 };
struct psr_msg_scene {
	uint16_t slot;            /* 0..15, chosen by the client */
	uint16_t flags;
	double ambient;           /* 0..1e6: light from everywhere: white shows it as it is */
	uint8_t background[3];    /* sRGB */
	uint16_t n_instances, n_lights;
	struct psr_msg_instance instance[PSR_WIRE_MAX_INSTANCES];
	struct psr_msg_light light[PSR_WIRE_MAX_LIGHTS];
}; /* about 80 KiB */

/* ---- cameras and lights that came with a model ---- */

#define PSR_WIRE_MAX_PRESETS 256 /* of each kind */
#define PSR_WIRE_HOME "home"     /* a camera that shows the whole model, its natural way up */

enum psr_wire_preset_kind { PSR_WIRE_PRESET_CAMERA = 1, PSR_WIRE_PRESET_LIGHT = 2 };
struct psr_msg_preset { /* in object coordinates; camera or light is 0, by kind */
	uint8_t kind;                        /* the decoder turns an unknown one into 0 and sets nothing else: leave
	                                      * this preset out */
	struct psr_camera camera;
	struct psr_msg_light light;          /* flags 0 */
	char name[PSR_WIRE_MAX_NAME + 1];    /* not empty */
};

/* ---- frames ---- */

enum psr_codec { PSR_CODEC_RAW = 0, PSR_CODEC_JPEG = 1, PSR_CODEC_ZSTD = 2, PSR_CODEC_PNG = 3 };
enum psr_wire_depth_format { PSR_WIRE_DEPTH_F32 = 1, PSR_WIRE_DEPTH_U16 = 2, PSR_WIRE_DEPTH_U16_HALF = 3 };
enum psr_wire_budget {
	PSR_WIRE_BUDGET_NONE = 0, PSR_WIRE_BUDGET_TIME = 1, PSR_WIRE_BUDGET_ERROR = 2, PSR_WIRE_BUDGET_SETTINGS = 3,
	PSR_WIRE_BUDGET_RMSE = 4,
};

struct psr_msg_settings { /* resolved settings: with them a frame is a pure function of models and request */
	uint8_t scale;       /* drawn at 1/scale of the size in each direction and enlarged: 1, 2 or 4 */
	uint8_t smooth;      /* 1: blends edges with the surface behind, and pixels with others of their surface; 2
	                      * (PSR_CAP_FINE), fine: draws so at twice the size, and takes means; else 0 */
	uint8_t pass;        /* level of refinement that frame 0 has at once, 0..4; above 0 for servers that offer a budget
	                      * of time or error */
	uint8_t splats;      /* 1 (PSR_CAP_SPLATS): leaves of octrees are splats, in frames of level 0; else 0 */
	double spacing_px;   /* greatest distance of neighbouring samples, pixels; 1 is [G]'s adequate sampling;
	                      * 2^-6..2^6 */
};

/* Settings in the count of a report's entry. Spacings are rounded to 2^-16 pixels. */
uint64_t psr_settings_pack(const struct psr_msg_settings *settings);
void psr_settings_unpack(struct psr_msg_settings *settings, uint64_t packed);

/* NO_HASHES: FRAME_END has none. SHARP (PSR_CAP_SHARP, view > 0): once the view is at rest, frame 1 has scale 1, smooth
 * edges and lossless codecs; refined frames follow it. */
enum psr_wire_frame_flag { PSR_WIRE_FRAME_NO_HASHES = 1, PSR_WIRE_FRAME_SHARP = 2 };

struct psr_msg_frame { /* client -> server */
	uint16_t slot;           /* scene */
	uint16_t pass_limit;     /* highest refinement to draw; 0: none */
	uint32_t width, height;  /* 1..16384 each, at most 64 Mpixel */
	uint32_t planes;         /* 1 << enum psr_plane, OR-ed; not 0. The wire has the same values */
	uint8_t color_codec;     /* fields of planes that the request leaves out are 0 */
	uint8_t color_quality;   /* JPEG: 1..100; else 0 */
	uint8_t depth_format;
	uint8_t depth_codec;     /* raw or zstd */
	uint8_t data_codec;      /* of normal, id, weight, words, block: raw or zstd */
	uint8_t budget;          /* enum psr_wire_budget: it tells which one of the next three is set, RMSE the second;
	                          * the other two are 0 */
	uint16_t flags;          /* enum psr_wire_frame_flag; the receiver checks that SHARP is not in view 0 */
	uint64_t time_budget_us; /* TIME: 1..2^53-1, from the start of work on the frame to its END in the output queue */
	double error_bound;      /* > 0. ERROR: of the geometric error, pixels; RMSE: of colour, codes of sRGB */
	struct psr_msg_settings settings; /* SETTINGS; width and height are multiples of the scale */
	uint32_t base;           /* id of an acknowledged frame of this view that the client still holds, or 0; the
	                          * receiver checks that it is below the request's id, and 0 in view 0 */
	struct psr_camera camera;
	double depth_min, depth_max; /* U16*: the range of depth, min < max, min > 0 in perspective; else 0 */
};

struct psr_msg_frame_begin { /* server -> client */
	uint16_t pass;           /* number of the frame in its answer: 0, 1, ... */
	uint16_t refine;         /* level of refinement; 0: none. The receiver checks that it fits the pass */
	uint32_t width, height, planes; /* as asked */
	uint8_t color_codec, color_quality; /* as asked or better: zstd for JPEG or PNG, a higher quality of JPEG */
	uint8_t depth_format, depth_codec, data_codec; /* as asked */
	uint8_t background[3];   /* colour of pixels that no rectangle covers, when there is no base */
	uint32_t base;           /* 0: no base; else rectangles go on top of frame (base, base_pass) */
	uint16_t base_pass;
	struct psr_msg_settings settings; /* resolved */
	double depth_min, depth_max; /* U16*: the range of depth, as asked; else 0 */
	struct psr_camera camera;    /* as asked */
};

enum psr_wire_frame_status {
	PSR_WIRE_FRAME_OK = 0,          /* drawn as asked */
	PSR_WIRE_FRAME_LATE = 1,        /* the time budget was not kept */
	PSR_WIRE_FRAME_COARSE = 2,      /* the error bound was not kept; of RMSE: no settings are foreseen to keep it */
};

enum psr_wire_report_id { /* ns is a time; the comment tells what `count` counts */
	PSR_WIRE_REPORT_PLAN = 1,    /* instances of the scene */
	PSR_WIRE_REPORT_CULL = 2,    /* blocks tested */
	PSR_WIRE_REPORT_WARP = 3,    /* samples that fell into the picture */
	PSR_WIRE_REPORT_GAPS = 4,    /* pixels with a sample whose weight is below 1 */
	PSR_WIRE_REPORT_RESOLVE = 5, /* pixels resolved: they have a sample and weight above 0 */
	PSR_WIRE_REPORT_SHADE = 6,   /* pixels shaded */
	PSR_WIRE_REPORT_FILL = 7,    /* pixels whose colour the fill changed */
	PSR_WIRE_REPORT_ENCODE = 8,  /* bytes of all RECT data of the frame */
	PSR_WIRE_REPORT_QUEUE = 9,   /* time waited before work started; frames of all clients waiting when it came */
	PSR_WIRE_REPORT_TOTAL = 10,  /* from the start of plan to the end of encode; threads of the server's pool */
	PSR_WIRE_REPORT_SHADOW = 11, /* samples drawn into the shadow maps made for this frame */
	PSR_WIRE_REPORT_SMOOTH = 12, /* pixels at edges */
	PSR_WIRE_REPORT_CORES = 13,  /* that cores worked for the frame, summed over all of them; 0 */
	/* of a budget of time, error or RMSE: the time foreseen, and the settings as of psr_settings_pack() */
	PSR_WIRE_REPORT_CHOSEN = 14,
	PSR_WIRE_REPORT_CHEAPER = 15, /* the next cheaper settings; left out if there are none */
	PSR_WIRE_REPORT_BETTER = 16,  /* the next better ones */
	/* values only, ns is 0: */
	PSR_WIRE_REPORT_SAMPLES_WARPED = 32, /* all samples of the blocks drawn */
	PSR_WIRE_REPORT_BLOCKS_DRAWN = 33,   /* after culling */
	PSR_WIRE_REPORT_BLOCKS = 34,         /* of all instances of the scene */
	PSR_WIRE_REPORT_PIXELS_COVERED = 35, /* weight above 0 before the fill */
	PSR_WIRE_REPORT_PIXELS_FILLED = 36,  /* of weight 0 that the fill gave a colour */
	PSR_WIRE_REPORT_SAMPLES = 37,        /* of all instances of the scene */
	PSR_WIRE_REPORT_DEPTH_LEVELS = 38,   /* level buffers in use */
	PSR_WIRE_REPORT_LIGHTS = 39,
	PSR_WIRE_REPORT_SHADOW_MAPS = 40,       /* in use */
	PSR_WIRE_REPORT_SHADOW_MAPS_DRAWN = 41, /* of these made for this frame, not kept */
	PSR_WIRE_REPORT_RMSE_CHOSEN = 42, /* foreseen for the settings of CHOSEN: codes of sRGB, times
	                                   * PSR_WIRE_RMSE_ONE; left out where nobody can foresee it */
	PSR_WIRE_REPORT_RMSE_CHEAPER = 43,
	PSR_WIRE_REPORT_RMSE_BETTER = 44,
	PSR_WIRE_REPORT_LEVELS = 45, /* drawn of the octree that lacks most: bits 0-7 its levels, 8-15 of its whole file;
	                              * left out where no model is a beginning */
	/* Instances of the scene that are drawn as blocks, as octrees and as differential points, and 2^32 times how many
	 * of them the scene left to the server; left out if none are */
	PSR_WIRE_REPORT_AS_BLOCKS = 46, PSR_WIRE_REPORT_AS_OCTREE = 47, PSR_WIRE_REPORT_AS_DPOINTS = 48,
	PSR_WIRE_REPORT_FINEST = 49, /* of the octree drawn down to most levels: bits 0-7 these, 8-15 all that it has; left
	                              * out if none is in view */
	/* Of all instances that are coloured so; left out where none is. */
	PSR_WIRE_REPORT_INTENSITIES = 52, /* bits 0-15 and 16-31: those at the ends of the ramp */
	PSR_WIRE_REPORT_CLASSES = 53,     /* 53 to 56: bit c is class c, of 64 each; words of 0 are left out */
	PSR_WIRE_REPORT_RETURNS = 57,     /* bits: a point is 0 the only return, 1 the first, 2 one between, 3 the last */
	PSR_WIRE_REPORT_EFFECTS = 64, /* plus the effect's number, see PROTOCOL.md; ns is the reason's number */
};
#define PSR_WIRE_RMSE_ONE 65536
struct psr_msg_report_entry { uint16_t id; uint64_t ns, count; };

struct psr_msg_frame_end { /* server -> client */
	uint16_t pass;             /* as in BEGIN */
	uint8_t is_final;          /* 1: the id ends here; else 0 */
	uint8_t status;            /* enum psr_wire_frame_status; the decoder turns an unknown one into OK */
	double error_px;           /* bound on the geometric error of this frame, pixels, >= 0 */
	uint32_t planes;           /* as in BEGIN: tells which hashes follow */
	uint8_t has_hashes;        /* 0: `hash` is all 0 */
	double depth_min, depth_max; /* range of this frame's finite depths; both 0 without any, or without the plane */
	uint64_t hash[PSR_N_PLANES]; /* by plane, psr_frame_hash() of the drawn frame; 0 for an absent plane */
	uint16_t n_entries;
	struct psr_msg_report_entry entry[PSR_WIRE_MAX_REPORT]; /* ids rising */
};

/* ---- statistics ---- */

enum psr_stat_id { /* counted for the whole server since its start */
	PSR_STAT_UPTIME_US = 1, PSR_STAT_CONNECTIONS = 2, PSR_STAT_CONNECTIONS_TOTAL = 3, PSR_STAT_MODELS = 4,
	PSR_STAT_MODEL_BYTES = 5, PSR_STAT_FRAMES = 6, PSR_STAT_FRAMES_FAILED = 7, PSR_STAT_FRAMES_WAITING = 8,
	PSR_STAT_BYTES_SENT = 9, PSR_STAT_BYTES_RECEIVED = 10, PSR_STAT_FRAMES_SUPERSEDED = 11,
	PSR_STAT_FRAMES_CANCELLED = 12, PSR_STAT_THREADS = 13,
	PSR_STAT_DROPPED_PEERS = 14, /* connections that the server closed for an error or a limit */
	PSR_STAT_MEMORY_BYTES = 15,  /* of models, workers, pictures and queues together */
	PSR_STAT_MEMORY_LIMIT = 16,  /* limit on MEMORY_BYTES */
	PSR_STAT_CONNECTIONS_NEW = 17, /* connections still without HELLO */
	PSR_STAT_CONNECTIONS_BUSY = 18, /* connections refused because the server was full */
	PSR_STAT_LOG_DROPPED = 19,   /* lines of its log that no reader took in time */
	PSR_STAT_FRAMES_TIMED_OUT = 20, /* frames ended over the server's limit on their time */
	PSR_STAT_FRAMES_LACKING = 21, /* part of FRAMES_WAITING: frames without memory at their turn */
	PSR_STAT_FRAMES_ON_BASE = 24, /* frames sent as changes to a base */
	PSR_STAT_BUILDS = 25,        /* builds that run */
	PSR_STAT_BUILDS_WAITING = 26,
	PSR_STAT_BUILDS_DONE = 27,
	PSR_STAT_BUILDS_FAILED = 28, /* or stopped */
	PSR_STAT_MODELS_LEFT = 29,   /* how often a model left memory though a handle or a scene held it */
	PSR_STAT_MODELS_RETURNED = 30, /* how often such a model came back */
	PSR_STAT_DRAW_US = 33,       /* time on cores of drawing and encoding */
	PSR_STAT_PEERS_SLOW = 34,    /* part of DROPPED_PEERS: they read too slowly */
	PSR_STAT_PEERS_SILENT = 35,  /* part of DROPPED_PEERS: they were silent too long */
	PSR_STAT_ANSWERED_P50_US = 36, /* percentiles of the time from a FRAME's arrival until the socket took the last byte of
	                                * its first picture */
	PSR_STAT_ANSWERED_P90_US = 37,
	PSR_STAT_ANSWERED_P99_US = 38,
	PSR_STAT_ANSWERED_MAX_US = 39,
};
struct psr_msg_stat { uint16_t id; uint64_t value; };
struct psr_msg_stats_reply {
	uint16_t n_stats;
	struct psr_msg_stat stat[PSR_WIRE_MAX_STATS]; /* ids rising; receivers skip unknown ones */
};

#ifdef __cplusplus
}
#endif
#endif
