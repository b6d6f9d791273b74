import sys,time,glob,json
from ev4 import *
D=sys.argv[1]; LB=sys.argv[2]; OUT=sys.argv[3]
A=[0.4,1,2.2,5,12,30]; Kp=[0.03,0.1,0.2,0.4,0.8]
def pair(C,c1,c2):
    """linear superposition"""
    co=c1['coordinates']+c2['coordinates']
    T=C.T
    raw=[c1['raw'][t]+c2['raw'][t]-C.nom['raw'][t] for t in range(T)]
    jac=[np.column_stack([c1['jacobian'][t],c2['jacobian'][t]]) for t in range(T)]
    c=dict(effects=c1['effects']+c2['effects'],coordinates=co,raw=raw,jacobian=jac,s=c1['s'],kind='linear',loss=0)
    # a few Gauss-Newton steps in whitened metric, linear
    W=Case3.white(C,c,1.0,0.15,1,1.2)
    sc=np.array([x['scale'] for x in co]); dv=np.array([x['value']-x['off'] for x in co])
    N=np.diag(1/sc**2); g=dv/sc**2
    for (r,S,J,l) in W:
        Am=np.eye(S.shape[1])+S.T@S; Ai=inv(Am)
        N=N+J.T@J-(S.T@J).T@Ai@(S.T@J); g=g+J.T@r-(S.T@J).T@Ai@(S.T@r)
    dl=-solve(N,g)
    lo=np.array([x['low']-x['value'] for x in co]); hi=np.array([x['high']-x['value'] for x in co])
    dl=np.clip(dl,np.minimum(lo,0),np.maximum(hi,0)); dl=np.clip(dl,-1.0*sc,1.0*sc)
    c['raw']=[raw[t]+jac[t]@dl for t in range(T)]
    c['coordinates']=[dict(x,value=x['value']+d) for x,d in zip(co,dl)]
    return c
for f in sorted(glob.glob(D+'/*.bin')):
    if os.path.getsize(f)<100: continue
    n=os.path.basename(f)[:3]
    if len(sys.argv)>4 and n not in sys.argv[4:]: continue
    t0=time.time()
    lab=json.load(open(LB+'/%s.json'%n)); C=Case4(f)
    truth='+'.join(sorted(e['id'] for e in lab['effects'])) or 'none'
    # screen
    quick=lambda c: Case3.score(C,c,kappa=0.15,a=1,tau=1.2) if False else C.score(c,a=1,kappa=0.15,tau=1.2)
    sets=dict(C.by)
    q={k:quick(c) for k,c in sets.items()}
    singles=sorted([k for k in sets if '+' not in k and k!='none'],key=lambda k:-q[k])
    for s1 in singles[:2]:
        prom=[]
        for s2 in singles:
            if s2==s1: continue
            k='+'.join(sorted([s1,s2]))
            if k in sets and sets[k]['kind']!='linear': continue
            c=pair(C,C.by[s1],C.by[s2]); prom.append((quick(c),k,c))
        prom.sort(key=lambda x:-x[0])
        for v,k,c in prom[:3]: sets[k]=c; q[k]=v
    order=sorted(sets,key=lambda k:-q[k]+3.4*len(sets[k]['effects']))[:10]
    for k in ('none',truth):
        if k in sets and k not in order: order.append(k)
    rows=[]
    for k in order:
        c=sets[k]; ne=len(c['effects']); g=[]
        for a in A:
            for kk in (Kp if ne else [0.1]):
                g.append((a,kk,C.score(c,a=a,kappa=kk,tau=1.2)))
        mat=[]
        for t in range(C.T):
            for ch,idx in enumerate(C.idx[t]):
                if len(idx)==0: continue
                tr=C.h['trials'][t]; s=(c['raw'][t][idx]-C.nom['raw'][t][idx])/tr['weight'][idx]
                mat.append((s**2).mean()/(C.n[t][ch]**2+np.mean(tr['model'][idx]**2)))
        rows.append(dict(set=k,ne=ne,kind=c['kind'],grid=g,mat=float(np.sqrt(max(mat))),loss=c.get('loss')))
    best=[c for c in C.c if c['kind']=='best']
    old='+'.join(sorted(best[0]['effects'])) if best else '?'
    json.dump(dict(case=n,kind=lab['kind'],truth=truth,gap=lab['gap_over_floor'],old=old or 'none',rows=rows,st=lab.get('stranger')),open(OUT+'/%s.json'%n,'w'))
    print(n,truth,'%.0fs'%(time.time()-t0)); sys.stdout.flush()
